#!/usr/bin/env python3
"""Strong and weak scaling as measured, a cost model fitted to it, and its forecast.

usage: model.py FOLDER     (with run.SPACING.PROCESSES.json and .log; writes scaling.csv there and a table to standard output)

Model of a solution with N unknowns on P processes that takes V preconditioned iterations in all levels:

  T = w N/P  +  V (n m a + V_s N_s/P_s ...)

  work       w N/P            w [s per unknown]: everything a process does alone, fitted to the runs of one process
  halo       V b (N/P)^(2/3) / B   b [bytes per iteration and (N/P)^(2/3)]: measured with two processes, times the six
                              sides that an inner process has for the one that each of two has
  latency    V (m k a + r a log2 P)   m messages per neighbour and iteration, r reductions per iteration: measured;
                              k = 26 neighbours of an inner process; a the network's latency
  coarsest   in r: its equations are gathered and solved by all

m and r grow with the number of levels, log8 of N / 600, as measured at their number of levels.
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

    start, work = fit_line([(d, one[d]["seconds"]) for d in sizes])
    _, memory = fit_line([(d, one[d]["memory_mb"]) for d in sizes])
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
        ["memory", f"{1e3 * memory:.2f} kB an unknown"],
        ["operations that PETSc counts", f"{flops:.0f} an unknown (without products of cells)"],
        ["iterations", f"{iterations} in all levels"],
        ["messages", f"{messages:.1f} an iteration, level and neighbour"],
        ["reductions", f"{reductions:.1f} an iteration and level"],
        ["bytes in messages", f"{halo:.0f} (N/P)^(2/3) an iteration and side"]])

    def forecast(n, p):
        share = n / p
        depth = max(math.log(n / 600, 8), 1)
        alone = work * share
        bytes_time = iterations * SIDES * halo * share ** (2 / 3) / BANDWIDTH
        waits = iterations * depth * LATENCY * (messages * NEIGHBOURS + reductions * math.log2(p))
        return alone, bytes_time, waits, memory * share

    for n in (1e8, 1e9):
        print(f"Forecast for {n:.0e} unknowns:\n")
        rows = []
        for p in (64, 256, 1024, 4096):
            alone, bytes_time, waits, mb = forecast(n, p)
            seconds = alone + bytes_time + waits
            rows.append([f"{p:,}", f"{n / p:,.0f}", f"{seconds:.0f}", f"{alone:.0f}", f"{bytes_time:.1f}", f"{waits:.2f}",
                         f"{alone / seconds:.2f}", f"{mb:,.0f}" + ("" if mb <= NODE_MEMORY_MB else " (too much)")])
        table(["processes", "unknowns each", "seconds", "work", "bytes", "latency", "efficiency", "MB each"], rows)
    print(f"Assumed: cores and memory as here, nodes of {NODE_MEMORY_MB / 1000:.0f} GB a core, messages of {1e6 * LATENCY:.0f} us "
          f"and {BANDWIDTH / 1e9:.0f} GB/s a process, compact parts with {NEIGHBOURS} neighbours, as many iterations as here, a "
          "file system that reads as fast as here. Left out: cores that share a node's memory (here two do), reading "
          "and writing one after the other, and steps of set-up whose messages grow with P (who owns a node is asked of all).")


main()
