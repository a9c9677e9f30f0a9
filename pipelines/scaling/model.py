#!/usr/bin/env python3
"""Strong and weak scaling as measured, a cost model fitted to it, and its forecast.

usage: model.py FOLDER     (with run.SPACING.PROCESSES.json and .log; writes scaling.csv there and a table to standard output)

Model of a solution with N unknowns by P processes that takes V preconditioned iterations, in all levels together:

  T = t + w N/P  +  V 6 h (N/P)^(2/3) / B  +  V L a (26 m + r log2 P)  +  f N / F

  work      t, w    [s, s per unknown] of a process, by the runs of two processes, which share the machine's memory
  halo      h       bytes that leave a process through one of its sides, per iteration and (N/P)^(2/3), as PETSc counted
                    for two processes, which have one side each; an inner process has six. B: its share of the network
  latency   m, r    messages to a neighbour and sums over all processes, per iteration and level, as PETSc counted;
                    L = log8(N / 600) levels, 26 neighbours; a: time of a message. The coarsest equations are in r
  writing   f       bytes of the result per unknown, written by one process after the other at F

Memory of a process is a line in N/P, by the runs of two processes.
"""
import csv
import glob
import json
import math
import re
import sys

LATENCY = 2e-6  # s, of a message between nodes (InfiniBand HDR, MPI)
BANDWIDTH = 5e9  # bytes/s that one process gets of its node's network
NEIGHBOURS = 26
SIDES = 6
FILE_BANDWIDTH = 1e9  # bytes/s that one process writes to a shared file
NODE_MEMORY_MB = 4000  # of one process, on nodes with 4 GB a core


def total(log, what):
    """The total over processes of a line of PETSc's log: max, ratio, average, total."""
    found = re.search(rf"^{re.escape(what)}:?[ \t]+(\S+)[ \t]+(\S+)(?:[ \t]+(\S+))?(?:[ \t]+(\S+))?", log, re.M)
    return float(found.group(4) or found.group(1)) if found else 0.0


def read(folder):
    rows = []
    for name in glob.glob(f"{folder}/run.*.json"):
        spacing, processes = re.search(r"run\.(.+)\.(\d+)\.json$", name).groups()
        with open(name) as file:
            report = json.load(file)
        with open(name[: -len("json")] + "log") as file:
            log = file.read()
        rows.append({
            "spacing_mm": float(spacing),
            "processes": int(processes),
            "dofs": report["lattice"]["dofs"],
            "iterations": report["linear_iterations"],
            "all_iterations": sum(l["linear_iterations"] for l in report["levels"]),
            "newton": report["newton_iterations"],
            "seconds": report["seconds"]["total"],
            "memory_mb": max(p["peak_memory_mb"] for p in report["processes"]),
            "flops": total(log, "Flops"),
            "messages": total(log, "MPI Msg Count"),
            "message_bytes": total(log, "MPI Msg Len (bytes)"),
            "reductions": total(log, "MPI Reductions"),
            "levels": len(report["levels"]),
            "result_bytes": int(open(name[: -len("json")] + "bytes").read()),
        })
    return sorted(rows, key=lambda r: (r["dofs"], r["processes"]))


def fit_line(points):
    """Least squares of y = a + b x."""
    n = len(points)
    mx, my = sum(x for x, _ in points) / n, sum(y for _, y in points) / n
    b = sum((x - mx) * (y - my) for x, y in points) / sum((x - mx) ** 2 for x, _ in points)
    return my - b * mx, b


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(str(v) for v in row) + " |")
    print()


def main():
    folder = sys.argv[1]
    runs = read(folder)
    with open(f"{folder}/scaling.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, runs[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(runs)
    one = {r["dofs"]: r for r in runs if r["processes"] == 1}
    two = {r["dofs"]: r for r in runs if r["processes"] == 2}

    print("# Scaling of hexsolve-mpi\n")
    print("Strong: the same body by one and by two processes, one thread each.\n")
    table(["unknowns", "Newton", "iterations 1 / 2", "seconds 1", "seconds 2", "speed-up", "MB a process 1 / 2"],
          [[f"{d:,}", two[d]["newton"], f"{one[d]['iterations']} / {two[d]['iterations']}", f"{one[d]['seconds']:.1f}",
            f"{two[d]['seconds']:.1f}", f"{one[d]['seconds'] / two[d]['seconds']:.2f}",
            f"{one[d]['memory_mb']:.0f} / {two[d]['memory_mb']:.0f}"] for d in one])
    sizes = sorted(one)
    print("Weak: about as many unknowns for each of two processes as for one.\n")
    table(["unknowns 1", "unknowns 2", "seconds 1", "seconds 2", "efficiency per unknown"],
          [[f"{a:,}", f"{b:,}", f"{one[a]['seconds']:.1f}", f"{two[b]['seconds']:.1f}",
            f"{one[a]['seconds'] / two[b]['seconds'] * b / (2 * a):.2f}"] for a, b in zip(sizes, sizes[1:])])

    start, work = fit_line([(d / 2, two[d]["seconds"]) for d in sizes])
    base, memory = fit_line([(d / 2, two[d]["memory_mb"]) for d in sizes])
    written = two[sizes[-1]]["result_bytes"] / sizes[-1]
    largest = two[sizes[-1]]
    iterations = largest["all_iterations"]
    # Each of two processes has one neighbour; a V-cycle's messages are those of all levels.
    levels = max(math.log(largest["dofs"] / 600, 8), 1)
    messages = largest["messages"] / 2 / iterations / levels
    reductions = largest["reductions"] / iterations / levels
    halo = largest["message_bytes"] / 2 / iterations / (largest["dofs"] / 2) ** (2 / 3)
    flops = one[sizes[-1]]["flops"] / sizes[-1]
    print("Cost model, fitted to these runs (see model.py for its equation):\n")
    table(["quantity", "value"], [
        ["work of a process", f"{1e6 * work:.1f} us an unknown, and {max(start, 0):.2f} s"],
        ["memory of a process", f"{base:.0f} MB and {1e3 * memory:.2f} kB an unknown"],
        ["result", f"{written:.0f} bytes an unknown"],
        ["operations that PETSc counts", f"{flops:.0f} an unknown (without products of cells)"],
        ["iterations", f"{iterations} in all levels"],
        ["messages", f"{messages:.1f} an iteration, level and neighbour"],
        ["reductions", f"{reductions:.1f} an iteration and level"],
        ["bytes in messages", f"{halo:.0f} (N/P)^(2/3) an iteration and side"]])

    def share_of(n, p):
        return n / p

    def forecast(n, p):
        share = share_of(n, p)
        depth = max(math.log(n / 600, 8), 1)
        alone = max(start, 0) + work * share
        bytes_time = iterations * SIDES * halo * share ** (2 / 3) / BANDWIDTH
        waits = iterations * depth * LATENCY * (messages * NEIGHBOURS + reductions * math.log2(p))
        return alone, bytes_time, waits, written * n / FILE_BANDWIDTH, base + memory * share

    for n in (1e8, 1e9):
        print(f"Forecast for {n:.0e} unknowns:\n")
        rows = []
        for p in (64, 256, 1024, 4096):
            alone, bytes_time, waits, writing, mb = forecast(n, p)
            seconds = alone + bytes_time + waits  # without writing, which does not get shorter
            rows.append([f"{p:,}", f"{n / p:,.0f}", f"{seconds:.0f}", f"{alone:.0f}", f"{bytes_time:.1f}", f"{waits:.2f}",
                         f"{work * share_of(n, p) / seconds:.2f}", f"{writing:.0f}", f"{mb:,.0f}" + ("" if mb <= NODE_MEMORY_MB else " (too much)")])
        table(["processes", "unknowns each", "seconds", "work", "bytes", "latency", "efficiency", "writing", "MB each"], rows)
    print(f"Seconds are of solving; writing comes after. Assumed: cores that share memory as the two here do, nodes of "
          f"{NODE_MEMORY_MB / 1000:.0f} GB a core, messages of {1e6 * LATENCY:.0f} us and {BANDWIDTH / 1e9:.0f} GB/s a process, "
          f"{FILE_BANDWIDTH / 1e9:.0f} GB/s to the result's file, parts with {NEIGHBOURS} neighbours, patches of conditions no larger than "
          "parts, as many iterations as here. Left out: reading, and set-up steps whose messages grow with P (who owns a "
          "node is asked of all). Above 715 million nodes PETSc needs 64-bit indices.")


main()
