"""What performance.sh measured, as performance.csv and a table (Markdown, on standard output).

usage: table.py FOLDER [OLD.csv]      OLD.csv: an earlier performance.csv to compare with
"""
import csv
import json
import pathlib
import re
import statistics
import sys

FLOPS_PER_CELL = 1152  # of one product with a 24 x 24 matrix; cells that are the same mirrored take fewer
# Bytes that a product has to move per cell: nodes and their numbers, and what each turned cell keeps.
NODE_BYTES = {"double": 24 + 24, "single": 12 + 12}
NUMBERS_OF_A_TURNED_CELL = 78
# Times of SOFA 26.12 for a like experiment, measured elsewhere on one thread with this peak [GFLOP/s]: cells, seconds.
SOFA_PEAK = 59
SOFA_SECONDS = {3: (244, 0.066), 2: (1357, 3.5), 1: (8848, 51.7)}


def read(path):
    return json.loads(path.read_text()) if path.exists() else None


class Rows:
    def __init__(self):
        self.rows = []

    def add(self, group, what, value, unit, aim=""):
        self.rows.append({"group": group, "what": what, "value": f"{value:.4g}" if isinstance(value, float) else str(value), "unit": unit, "aim": aim})


def machine(folder, rows):
    both = {}
    for name in ("machine.1.json", "machine.json"):
        m = read(folder / name)
        both[name] = m
        at = f"{m['threads']} thread" + ("s" if m["threads"] > 1 else "")
        rows.add("machine", f"triad, {at}", m["triad_gb_s"], "GB/s")
        rows.add("machine", f"multiply-adds in double precision, {at}", m["double_gflops"], "GFLOP/s")
        rows.add("machine", f"multiply-adds in single precision, {at}", m["single_gflops"], "GFLOP/s")
    return both["machine.1.json"], both["machine.json"]


def operator(folder, rows, limits):
    linear_product = {}
    for level, kind in ((0, "cells alike"), (2, "cells unlike")):
        for strain in ("cauchy", "corotational"):
            s = read(folder / f"solver.{strain}.{level}.json")
            if strain == "cauchy":
                linear_product[level] = s["product_seconds"] / s["cells"]
            group = f"operator, {strain}, {kind} ({s['cells']} cells)"
            for precision, seconds in (("double", s["product_seconds"]), ("single", s["single_product_seconds"])):
                per_cell = seconds / s["cells"]
                size = 8 if precision == "double" else 4
                moved = NODE_BYTES[precision] + 4 * 8 + (size * NUMBERS_OF_A_TURNED_CELL if strain == "corotational" else 0)
                if kind == "cells unlike":
                    moved += size * 576
                aim = "" if kind == "cells unlike" else "50 %" if strain == "cauchy" else "35 %, or 60 % of triad"
                rows.add(group, f"{precision} precision: time per cell", 1e9 * per_cell, "ns")
                rows.add(group, f"{precision} precision: of the multiply-adds the machine can do",
                         100 * FLOPS_PER_CELL / per_cell / 1e9 / limits[f"{precision}_gflops"], "%", aim)
                rows.add(group, f"{precision} precision: of the triad's bandwidth",
                         100 * moved / per_cell / 1e9 / limits["triad_gb_s"], "%")
            in_products = s["product_seconds"] / s["cells"] / linear_product[level]
            rows.add(group, "V-cycle, in linear products", s["cycle_products"] * in_products, "", "10")
            rows.add(group, "set-up of the cycle, in linear products", s["multigrid_set_up_products"] * in_products, "")
            if strain == "corotational":
                rows.add(group, "linearizing, in linear products", s["linearize_products"] * in_products, "")
                rows.add(group, "linearizing with projection, in linear products", s["linearize_projected_products"] * in_products, "")
    return linear_product[0]


def runs_of(folder, case):
    return [read(p) for p in sorted(folder.glob(f"solve.{case}.*.json"))]


def median_of(runs, get):
    return statistics.median(get(r) for r in runs)


def coarse(folder, rows, one_thread):
    for level, (cells, seconds) in SOFA_SECONDS.items():
        runs = runs_of(folder, f"coarse.{level}")
        if not runs:
            continue
        own_cells = runs[0]["lattice"]["cells"]
        own = median_of(runs, lambda r: r["seconds"]["setup"] + r["seconds"]["solve"])
        group = f"level {level}, {own_cells} cells, one thread"
        rows.add(group, "40 mm pull to 1e-6", own, "s")
        rows.add(group, f"speed over SOFA's ({cells} cells), per cell and peak",
                 seconds * SOFA_PEAK / cells / (own * one_thread["double_gflops"] / own_cells), "", "20" if level < 3 else "")
        rows.add(group, "memory", runs[0]["peak_memory_mb"], "MB")


def sizes(folder, rows, linear_product, case, tolerance, aims, products):
    first = None
    for name, aim in aims.items():
        runs = runs_of(folder, f"{case}.{name}")
        if not runs:
            continue
        r = runs[0]
        dofs, cells = r["lattice"]["dofs"], r["lattice"]["cells"]
        seconds = median_of(runs, lambda r: r["seconds"]["total"])
        group = f"40 mm pull to {tolerance}, {dofs / 1e6:.2f} M unknowns"
        rows.add(group, "unknowns", dofs, "")
        rows.add(group, "cells", cells, "")
        rows.add(group, "cold start to written result", seconds, "s", aim)
        for phase in ("read", "setup", "solve", "write"):
            rows.add(group, f"of that {phase}", median_of(runs, lambda r: r["seconds"][phase]), "s")
        product = linear_product * cells
        rows.add(group, "equilibrium, in linear products", median_of(runs, lambda r: r["seconds"]["solve"]) / product, "", products)
        rows.add(group, "file to first residual, in linear products",
                 median_of(runs, lambda r: r["seconds"]["read"] + r["seconds"]["setup"]) / product, "", "100")
        for phase, part in r["levels"][-1].get("seconds_of", {}).items():
            rows.add(group, f"finest level: {phase}", part, "s")
        rows.add(group, "finest level: Newton steps", r["newton_iterations"], "")
        rows.add(group, "finest level: linear iterations", r["linear_iterations"], "")
        per_dof = seconds / dofs
        first = first or per_dof
        rows.add(group, "time per unknown over that of the smallest", per_dof / first, "", "1.5")
        rows.add(group, "memory per unknown", r["peak_memory_mb"] * 2**20 / dofs, "bytes", "400")
        rows.add(group, "memory", r["peak_memory_mb"] / 1024, "GB", "4" if name == "7.9M" else "")


def calculix(folder, rows):
    for name in ("0.04M", "0.13M"):
        for strain, pull in (("cauchy", "40 mm pull, small strain"), ("green-lagrange", "10 mm pull, large strain")):
            own, other = read(folder / f"calculix.{name}.{strain}.json"), read(folder / f"calculix.{name}.{strain}.ccx.json")
            if not other:
                continue
            group = f"{pull}, beside CalculiX, {own['lattice']['dofs'] / 1e6:.2f} M unknowns"
            rows.add(group, "hexsolve, cold start to written result", own["seconds"]["total"], "s")
            rows.add(group, "ccx, deck to displacements", other["seconds"], "s")
            rows.add(group, "times as long", other["seconds"] / own["seconds"]["total"], "", "100")


def instructions(folder, rows):
    """Own instructions of the kernels for each of their calls."""
    for path in (p for p in sorted(folder.glob("callgrind.*")) if p.suffix != ".json"):
        names, own, calls = {}, {}, {}
        current, skip = None, False
        for line in path.read_text().splitlines():
            if match := re.match(r"(c?fn)=\((\d+)\)(?: (.*))?", line):
                kind, number, name = match.groups()
                if name:
                    names[number] = name
                if kind == "fn":
                    current = number
                else:
                    callee = number
            elif line.startswith("calls="):
                calls[callee] = calls.get(callee, 0) + int(line.split()[0][6:])
                skip = True
            elif line[:1] in "0123456789+-*" and current:
                parts = line.split()  # position, instructions
                if not skip and len(parts) == 2:
                    own[current] = own.get(current, 0) + int(parts[1])
                skip = False
        of_kernel = {}  # the most: beside each kernel there is a jump to it
        for number, name in names.items():
            kernel = re.match(r"hexsolver::InRegisters<hexsolver::\(anonymous namespace\)::(\w+Product)<(float|double)>", name)
            if kernel and calls.get(number) and own.get(number):
                cells = 8
                precision = "single" if kernel[2] == "float" else "double"
                what = f"{path.suffix[1:]}: {kernel[1]}, {precision} precision, per cell"
                of_kernel[what] = max(of_kernel.get(what, 0), own[number] / calls[number] / cells)
        for what, count in of_kernel.items():
            rows.add("instructions (callgrind)", what, count, "")


def main():
    folder = pathlib.Path(sys.argv[1])
    rows = Rows()
    one_thread, limits = machine(folder, rows)
    linear_product = operator(folder, rows, limits)
    coarse(folder, rows, one_thread)
    sizes(folder, rows, linear_product, "auto", "\"auto\"", {"0.13M": "", "1.0M": "", "4.1M": "20", "7.9M": "35"}, "250")
    sizes(folder, rows, linear_product, "size", "1e-6", {"0.13M": "2", "1.0M": "10", "4.1M": "45", "7.9M": "90"}, "400")
    calculix(folder, rows)
    instructions(folder, rows)
    with open(folder / "performance.csv", "w", newline="") as out:
        writer = csv.DictWriter(out, ["group", "what", "value", "unit", "aim"])
        writer.writeheader()
        writer.writerows(rows.rows)
    old = {}
    if len(sys.argv) > 2:
        with open(sys.argv[2], newline="") as file:
            old = {(r["group"], r["what"]): r["value"] for r in csv.DictReader(file)}
    print("| | | measured |" + (" before |" if old else "") + " aim |")
    print("|---|---|---|" + ("---|" if old else "") + "---|")
    group = None
    for r in rows.rows:
        cells = ["" if r["group"] == group else r["group"], r["what"], f"{r['value']} {r['unit']}".strip()]
        if old:
            cells.append(old.get((r["group"], r["what"]), ""))
        print("| " + " | ".join(cells + [r["aim"]]) + " |")
        group = r["group"]


main()
