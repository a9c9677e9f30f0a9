#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The measured numbers of the manual, made from the tables of one run that are kept in docs/measured.

usage: docs/make_numbers.py [--check]
       docs/make_numbers.py --keep BENCH PERFORMANCE TEST_VERIFICATION

Between `<!-- numbers: NAME -->` and `<!-- end -->` a page says what NAME below makes of the tables. --check writes nothing and
fails where a page says something else, or where its prose names a time, a size, a percentage or a factor outside of such a block
that ALLOWED does not know. --keep takes over what `./run bench`, `./run bench performance` left in their folders, and what the
executable test_verification prints.
"""
import collections
import csv
import json
import math
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
KEPT = ROOT / "docs" / "measured"
sys.path.insert(0, str(ROOT / "pipelines" / "accuracy"))
import tables as bench_tables  # noqa: E402
from tables import markdown as table  # noqa: E402

PAGES = ["README.md", "docs/*.md", "docs/tasks/*.md", "pipelines/*/README.md"]
# What is no measurement: inputs, limits of tests, what follows from a formula.
MEASURED = re.compile(r"(?<![\w.])\d[\d.,]* ?(?:s|ms|seconds|minutes|MB|GB|kB|%|times|steps a second)(?![\w/²³])")
ALLOWED = json.loads((KEPT / "allowed.json").read_text())


def rows_of(name):
    with open(KEPT / name, newline="") as file:
        return list(csv.DictReader(file))


def read(name):
    return json.loads((KEPT / (name + ".json")).read_text())


def digits(value, count=2):
    """So many significant digits, never as 1e+03."""
    value = float(value)
    assert math.isfinite(value), "a number that is none"
    if value == 0:
        return "0"
    places = count - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):,.{max(0, places)}f}" if abs(value) >= 1e-3 else power(value, count - 1)


def power(value, places=0):
    """As 7e-6."""
    return f"{value:.{places}e}".replace("e-0", "e-")


def spread(values):
    return f"{digits(statistics.median(values))} ({digits(min(values))} to {digits(max(values))})"


def cells(method="cells"):
    """(law, level) -> row of accuracy.csv, to the sharpest tolerance."""
    rows = [r for r in rows_of("accuracy.csv") if r["method"] == method]
    sharpest = min(float(r["tolerance"]) for r in rows)
    assert all(r["converged"] == "true" for r in rows)
    return {(r["law"], int(r["level"])): r for r in rows if float(r["tolerance"]) == sharpest}


def about():
    program, date, *newer = (KEPT / "about.txt").read_text().splitlines()
    peak = read("motion")["peak_gflops_of_a_thread"]
    return (f"Measured with {program} on {date}, on one thread of {peak:.0f} GFLOP/s where nothing else is said"
            + (f"; {newer[0]}" if newer else "") + ". Ratios carry over to another machine, seconds do not.")


def accuracy():
    found, times = bench_tables.of_positions(KEPT), cells()
    of_condensed, times_of_condensed = bench_tables.of_positions(KEPT, "condensed"), cells("cells, condensed")
    of_graded, times_of_graded = bench_tables.of_positions(KEPT, "graded"), cells("cells, graded")
    edge = lambda level: 2 * 2 ** level  # noqa: E731
    def row(name, errors, times, level):
        return [name, f"{int(times['cauchy', level]['dofs']):,}", *(spread(errors[level][law]) if level in errors else "none" for law in ("cauchy", "corotational")),
                *(digits(times[law, level]["total_s"]) + " s" for law in ("cauchy", "corotational"))]
    rows = [row(f"{edge(level)} mm", found, times, level) for level in [*sorted(found, reverse=True), 0]]
    rows += [row(f"{edge(level)} mm, condensed", of_condensed, times_of_condensed, level) for level in sorted(of_condensed, reverse=True)]
    coarsest = max(found)  # of those measured; the lattice has one more, which graded cells reach
    rows += [row(f"{edge(level)} to {edge(min(level + 2, coarsest + 1))} mm", of_graded, times_of_graded, level) for level in sorted(of_graded, reverse=True) if level < coarsest]
    return table(["cells of", "unknowns", "mean error, small strain [mm]", "co-rotational", "time, small strain", "co-rotational"], rows)


def limits():
    return table(["law", "voxels to quadratic tetrahedra [mm]", "those from a quarter as many [mm]"],
                 [[{"cauchy": "small strain"}.get(r["law"], "co-rotational"), digits(r["from_voxels_mm"]), digits(r["from_a_quarter_as_many_mm"])]
                  for r in read("limits") if r.get("from_voxels_mm")])


def law_of_strain():
    off = max(float(r["law_difference_mm"]) for r in cells().values() if r["law"] == "cauchy")
    return f"Small strain alone is {digits(off)} mm off at this pull, whatever the cells: the law comes first."


def least_seconds(rows, law, is_method, limit):
    fit = [float(r["total_s"]) for r in rows if r["law"] == law and is_method(r["method"]) and r["converged"] == "true" and
           float(r["tolerance"]) <= 1e-6 and r["to_tets_mm_mean"] and float(r["to_tets_mm_mean"]) <= limit]
    return min(fit, default=None)


def tetrahedra():
    rows = rows_of("accuracy.csv")
    kinds = [lambda m: m == "cells", lambda m: m == "cells, condensed", lambda m: m == "cells, graded", lambda m: m.startswith("tetrahedra") and "graded" not in m,
             lambda m: m.startswith("tetrahedra, graded")]
    out = []
    for limit in (1, 0.7, 0.5, 0.3, 0.2):
        row = [f"{limit} mm"]
        for law in ("cauchy", "corotational"):
            seconds = [least_seconds(rows, law, kind, limit) for kind in kinds]
            row += [digits(s) if s else "" for s in seconds]
        out.append(row)
    header = [f"{kind}, {law}" for law in ("small strain", "co-rotational") for kind in ("cells", "condensed cells", "graded cells", "tetrahedra", "tetrahedra smaller at supports")]
    return table(["for a mean error of", *header], out)


def uniform():
    out = []
    for r in read("paper")["uniform"]:
        case, size = r["case"].rsplit(", ", 1)
        if r["boundary_cells"]:
            out.append([case, size.replace(" cells [mm]", ""), digits(r["ours"]), digits(r["uniform"]), digits(r["uniform"] / r["ours"]),
                        f"{r['energy']:.2f}", f"{r['uniform_energy']:.2f}"])
    return table(["body", "cells of", "error [mm]", "of averaged cells [mm]", "ratio", "energy over the voxels'", "of averaged cells"], out)


def effects():
    out = []
    for r in read("effects")["effects"]:
        assert r["converged"], r
        change = r.get("change_mm")
        out.append([r["effect"], digits(r["time_over_linear"]), f"{r['memory_mb']:.0f}", r["newton_iterations"],
                    f"{change['mean']:.2f}" if change else "", f"{change['max']:.2f}" if change else ""])
    return table(["effect added", "time over linear", "memory [MB]", "Newton steps", "displacement changes by, mean [mm]", "at most [mm]"], out)


def verification(pattern):
    return re.findall(pattern, (KEPT / "verification.txt").read_text(), re.M)


def dilatation():
    found = collections.defaultdict(dict)
    for nu, level, mean, full in verification(r"^ +(0\.4\d+) +(\d) +([0-9.]+) ([0-9.]+)$"):
        found[nu][int(level)] = f"{float(mean):.2f}, {float(full):.2f}"
    return table(["ν", "16 mm cells: mean, full", "8 mm", "4 mm", "2 mm"], [[nu, *(of[level] for level in (3, 2, 1, 0))] for nu, of in found.items()])


def reading():
    by_level = collections.defaultdict(dict)
    for r in rows_of("reading.csv"):
        by_level[r["cells"]][r["error_estimate"]] = r
    out = []
    for number, of in by_level.items():
        pair = [of["off"], of["look"]]
        out.append([number, *(f"{int(r['instructions']) / 1e6:,.0f}" for r in pair), *(f"{float(r['memory_mb']):.0f}" for r in pair),
                    *(f"{int(r['bytes_read']) / 1e6:.1f}" for r in pair), f"{int(of['look']['result_bytes']) / 1e6:.2f}"])
    return table(["cells", "instructions [million], without", "with", "memory [MB], without", "with", "read [MB], without", "with", "result [MB]"], out)


def motion():
    bench = read("motion")
    return table(["nodes", "cells", "steps/s", "with a surface of 229 points", "1,455", "5,541"],
                 [[f"{r['nodes']:,}", f"{r['cells']:,}", *(f"{digits(s, 3)}" for s in [r["steps_per_second"], *(x["steps_per_second"] for x in r["surfaces"])])]
                  for r in bench["levels"]])


def solvers():
    rows = read("motion")["solvers"]
    assert all(r["solved"] for r in rows + read("motion")["levels"] + read("motion")["rotations"])
    plain = next(r["ms_per_step"] for r in rows if r["solver"] == "cg" and r["iterations"] == 10)
    return table(["solver", "iterations", "time over 10 of cg", "off, part of the displacement"],
                 [[f'`"{r["solver"]}"`', r["iterations"] or "converged", f"{r['ms_per_step'] / plain:.1f}", digits(r["relative_difference"]) if r["iterations"] else ""]
                  for r in rows])


def rotations():
    ms = {r["rotation"]: r["ms_per_step"] for r in read("motion")["rotations"]}
    return (f"The paper's rotation of averaged edges takes {ms['edges'] / ms['polar']:.2f} times as long as the polar one, 10 plain iterations a step "
            "on the same cells.")


def size():
    found = collections.defaultdict(lambda: collections.defaultdict(dict))  # unknowns, tolerance
    for r in rows_of("performance.csv"):
        if group := re.fullmatch(r"40 mm pull to (\S+), (\S+) M unknowns", r["group"]):
            tolerance, unknowns = group.groups()
            found[unknowns][tolerance][r["what"]] = float(r["value"])
    out = []
    for of in found.values():
        auto, sharp = of['"auto"'], of["1e-6"]
        out.append([f"{sharp['unknowns']:,.0f}", f"{sharp['cells']:,.0f}", digits(auto["cold start to written result"]),
                    digits(sharp["cold start to written result"]), f"{1024 * sharp['memory']:,.0f} MB"])
    assert out
    return table(["unknowns", "cells", 'seconds, `tolerance = "auto"`', "`1e-6`", "memory"], out)


def beside_calculix():
    found = collections.defaultdict(dict)
    for r in rows_of("performance.csv"):
        if group := re.fullmatch(r"(.*), beside CalculiX, (\S+) M unknowns", r["group"]):
            found[group.groups()][r["what"]] = float(r["value"])
    out = [[what, f"{float(unknowns):.2f} million", digits(of["hexsolve, cold start to written result"]), digits(of["ccx, deck to displacements"]), f"{of['times as long']:.0f}"]
           for (what, unknowns), of in found.items()]
    assert out
    return table(["", "unknowns", "hexsolve [s]", "CalculiX [s]", "times as long"], out)


def table1():
    rows = read("paper")["table1"]
    off = lambda of: max(abs(r["ours"] - r["reference"]) / (r["reference"] - 0.5) for r in rows if of in r["case"])  # noqa: E731
    linear = rows[0]
    heights = {r["name"]: r["growth_mm"]["limit"] for r in json.loads((ROOT / "tests/data/limits.json").read_text()) if "cylinder" in r["name"]}
    best = max(heights.values())
    mean = {p: next(r for r in rows if r["case"].startswith(f"{p} %") and "mean" in r["case"]) for p in (10, 30)}
    more = {p: 100 * ((r["neo_hooke"] - 0.5) / (r["reference"] - 0.5) - 1) for p, r in mean.items()}
    assert max(heights, key=heights.get) == "cylinder, cauchy, height 43, 10 %"
    assert min(more.values()) > 100 * off("mean dilatation")
    return "\n".join([
        f"- The \"non-linear\" Ansys radii are 0.5 + 0.331052 × compression to all digits, and so linear ones. They bulge {100 * ((linear['paper'] - 0.5) / (linear['reference'] - 0.5) - 1):.0f} % more "
        f"than a clamped cylinder as high as wide does, and {100 * (3.31052 / best - 1):.0f} % more than one of 43 mm of 100 mm width, which bulges most of those tried (30 to 200 mm). The paper does not give its height.",
        f"- Our cells of 20 mm are within {100 * off('mean dilatation'):.0f} % of the bulge of their own limit at ν = 0.49, well fitted or not; with the paper's cells, whose dilatation is not averaged, within {100 * off(', the paper'):.0f} %.",
        f"- That limit is the co-rotational one. Neo-Hookean material bulges {more[10]:.0f} % more at 10 % of compression and {more[30]:.0f} % more at 30 %: more than these cells are off.",
    ])


def table2():
    out = []
    for r in read("paper")["table2"]:
        if "cells" in r["case"]:
            out.append([r["case"].replace(" [mm]", ""), digits(r["paper"]), digits(r["ours"]), digits(r["reference"]), digits(r["to_limit_mm"])])
    return table(["", "paper [mm]", "ours, measured so", "the voxels, measured so", "ours to the voxels"], out)


def table2_words():
    rows = [r for r in read("paper")["table2"] if "cells" in r["case"]]
    farther = sum(r["ours"] > r["paper"] for r in rows)
    worst = max(rows, key=lambda r: r["ours"] / r["paper"])
    assert all(fine["ours"] < coarse["ours"] for coarse, fine in zip(rows[::2], rows[1::2]))
    return (f"Measured as published, ours are farther off than the paper's in {farther} of the {len(rows)} rows of cells ({digits(worst['ours'])} against {digits(worst['paper'])} mm at worst), "
            "and nearer with smaller cells in all of them.")


def figure14():
    rows = [r for r in read("paper")["table3"] if r["paper"]]
    return (f"**Figure 14.** {digits(min(r['ours'] for r in rows), 3)} to {digits(max(r['ours'] for r in rows), 3)} steps a second where the paper had {min(r['paper'] for r in rows):.0f} to "
            f"{max(r['paper'] for r in rows):.0f} with about as many cells and as many points; the paper's include drawing, on a laptop of 2008, ours do not, on one thread of today.")


def figure7():
    rows = read("paper")["fig7"]
    ours, averaged = ([r[key] for r in rows] for key in ("to_fine_mm", "uniform_to_fine_mm"))
    return (f"**Figure 7.** A beam's cells may lie as they like: {digits(min(ours))} to {digits(max(ours))} mm from cells of 2 mm, "
            f"averaged cells {digits(min(averaged))} to {digits(max(averaged))} mm.")


def volume():
    seconds = bench_tables.volumes(KEPT)
    cells_drawn = re.search(r"(\d+) cells", (KEPT / "volume.txt").read_text())[1]
    return (f"512 × 512 pixels with 101 planes and {int(cells_drawn):,} cells: {1 / seconds['flat']:.0f} pictures a second drawn on one thread, {1 / seconds['lit']:.0f} with light. The paper had 10, with a graphics card of its time.")


def calculix():
    rows = verification(r"^(\S+) +\d+ nodes: mean \S+, largest (\S+) mm; reactions (\S+) of")
    kinds = collections.defaultdict(list)
    for name, largest, reactions in rows:
        law = "small strain" if "linear" in name else "St. Venant-Kirchhoff" if "stvk" in name else "neo-Hookean"
        kinds[law].append((float(largest), float(reactions)))
    return table(["law", "bodies and loads", "largest distance of any node [mm]", "reactions off by, of the largest"],
                 [[law, len(of), *(power(max(column)) for column in zip(*of))] for law, of in kinds.items()])


def smooth():
    beams = [float(error) for level, error in verification(r"^nu [0-9.]+, level (\d): tip [-0-9.]+ mm, off by ([0-9.]+) %") if level == "0"]
    cylinder = [float(e) for level, e in verification(r"^level (\d): radius grows by [0-9.]+ mm, off by ([0-9.]+) %") if level == "0"]
    stvk = [abs(float(e)) for e in verification(r"^nu [0-9.]+: tip .* and (\S+) %")]
    pressed = [abs(float(e)) for e in verification(r"^pressed by .* off by (\S+) %")]
    sliding = [max(map(float, of)) for of in verification(r"^\S+: reactions off by (\S+) %, displacement by (\S+) % in the mean")]
    punch = [abs(float(e)) for e in verification(r"^cells of 1 mm, .* force \S+ N, off by (\S+) %")]
    plates = [float(e) for e in verification(r"^offset .* off by (\S+) at most")]
    return table(["body, of voxels of 1 to 2 mm", "held against", "how far off"], [
        ["a hanging beam, ν = 0.3 and 0.45", "quadratic elements of CalculiX, extrapolated", f"{max(beams):.1f} %"],
        ["the same, St. Venant-Kirchhoff material", "likewise", f"{max(stvk):.1f} %"],
        ["a pressed cylinder of ν = 0.49", "axisymmetric quadratic elements of CalculiX, extrapolated", f"{max(cylinder):.1f} %"],
        ["the same of neo-Hookean material, pressed by up to 30 %", "axisymmetric quadratic elements of another program", f"{max(pressed):.1f} %"],
        ["a block pressed onto a larger one, on which it slides", "CalculiX on the same voxels, surfaces almost hard", f"{max(sliding):.1f} %"],
        ["two that meet in a point, cells of 1 mm: force", "axisymmetric quadratic elements of CalculiX, without friction", f"{max(punch):.1f} %"],
        ["sliding plates, large strain, every level and offset", "the exact stretch", power(max(plates))],
    ])


def rows_of_markdown(page):
    """Cells of all rows of a page's tables."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in (ROOT / page).read_text().splitlines() if line.startswith("|")]


def estimates_table(name):
    """Of a table of pipelines/estimates: its rows, those of all mean errors and accuracies, levels and unknown ones."""
    rows = rows_of_markdown(f"pipelines/estimates/{name}.md")
    means = next(r for r in rows if r[0] == "all")
    return rows, means, rows[-1], int(means[2]), int(means[3])


def drawn(name, what):
    rows, means, asked, levels, unknown = estimates_table(name)
    reactions = [r for r in rows if r[0] == "all"][2]
    return (f"Drawn by lot{what} ([table]({name}.md)): {means[6]} of {levels} estimates of the mean error within a factor of 2, {means[7]} within 3, {unknown} more unknown; of {reactions[2]} reactions {reactions[6]} and "
            f"{reactions[7]}; of {asked[1]} accuracies {asked[4]} were broken.")


def estimates_drawn():
    return drawn("drawn", "")


def estimates_drawn_graded():
    return drawn("drawn_graded", ", graded")


def estimates_graded():
    rows, means, asked, levels, unknown = estimates_table("graded")
    return (f"Graded cells ([table](graded.md)): {means[6]} within a factor of 2, {means[7]} within 3, {means[8]} below a third, {unknown} of {levels + unknown} levels unknown; "
            f"of {asked[1]} accuracies {asked[4]} were broken.")


def estimates():
    rows, means, asked, levels, unknown = estimates_table("table")
    equations = next(r for r in rows if r[0].startswith("over the true mean error"))
    return (f"The [table](table.md): {means[6]} of the estimates of the mean error are within a factor of 2 of the truth, {means[7]} within 3, "
            f"{unknown} of {levels + unknown} levels say that it is unknown; of {asked[1]} accuracies {asked[4]} were broken. "
            f"What `tolerance = \"auto\"` leaves of the equations is at most {100 * float(equations[4]):.2g} % of the true mean error of the cells, "
            f"of {equations[1]} levels; in the median {100 * float(equations[2]):.1g} %.")


def plans():
    rows = [r for r in rows_of_markdown("pipelines/plans/table.md")[2:] if r[5]]
    times, memory = [float(r[6]) for r in rows], [float(r[8]) for r in rows]
    return (f"The [table](table.md): of {len(rows)} solutions {sum(0.5 <= t <= 2 for t in times)} took what was expected within a factor of 2, "
            f"{sum(1 / 1.3 <= m <= 1.3 for m in memory)} as much memory within 1.3. Expected was {min(times)} to {max(times)} times the time, "
            f"{min(memory)} to {max(memory)} times the memory.")


def graded():
    def least_and_most(cells, finest=None):
        told = [r[6] for r in rows_of_markdown("pipelines/graded/table.md") if r[1] == cells and r[6] != "unknown" and finest in (None, r[2])]
        return " to ".join(str(pick(float(re.findall(r"[0-9.]+", t)[n]) for t in told)) for pick, n in ((min, 1), (max, 2)))

    return (f"Estimates of graded cells are {least_and_most('graded')} times the true error; across fissures {least_and_most('graded, split')}, down to voxels {least_and_most('graded, split', '2')}. Bending: "
            f"{least_and_most('graded, bending')}, condensed: {least_and_most('graded, condensed')}, soft: {least_and_most('graded, soft')}, condensed and soft: {least_and_most('graded, condensed and soft')}.")


def fits():
    return (ROOT / "pipelines/fit/table.md").read_text().strip()


NUMBERS = {f.__name__: f for f in (about, limits, accuracy, law_of_strain, tetrahedra, uniform, effects, dilatation, reading, motion, solvers, rotations, size, beside_calculix, table1,
                                   table2, table2_words, figure14, figure7, volume, calculix, smooth, estimates, estimates_graded, estimates_drawn, estimates_drawn_graded, plans, graded, fits)}
BLOCK = re.compile(r"<!-- numbers: (\w+) -->\n.*?<!-- end -->", re.S)


def filled(text):
    return BLOCK.sub(lambda m: f"<!-- numbers: {m[1]} -->\n{NUMBERS[m[1]]()}\n<!-- end -->", text)


def prose_of(text):
    """Without blocks of numbers, of code, and code in lines."""
    text = re.sub(r"```.*?```", "", BLOCK.sub("", text), flags=re.S)
    return re.sub(r"`[^`]*`|^    .*$", "", text, flags=re.M)


def strangers(page, text):
    """Measured numbers of a page's prose that no table makes."""
    allowed = ALLOWED.get(page, [])
    for line in prose_of(text).splitlines():
        for known in allowed:
            line = line.replace(known, "")
        yield from (f"{page}: '{m[0]}' in: {line.strip()[:120]}" for m in MEASURED.finditer(line))


def keep(bench, performance, test):
    for name in ("about.txt", "accuracy.csv", "positions.jsonl", "effects.json", "motion.json", "paper.json", "volume.txt", "reading.csv"):
        shutil.copyfile(pathlib.Path(bench) / name, KEPT / name)
    references = json.loads((pathlib.Path(bench) / "accuracy.json").read_text())["about"]["references"]
    (KEPT / "limits.json").write_text(json.dumps(references, indent=1) + "\n")
    shutil.copyfile(pathlib.Path(performance) / "performance.csv", KEPT / "performance.csv")
    told = subprocess.run([test, "--gtest_filter=*Calculix*:*HangingBeam*:PressedCylinder*:SlidingPlates*:Punch*"], capture_output=True, text=True, check=True,
                          env=dict(os.environ, HEXTOOLS_TESTS="full")).stdout
    (KEPT / "verification.txt").write_text("".join(line + "\n" for line in told.splitlines() if not re.match(r"\[|Note|Running", line) and line))


def main():
    if "--keep" in sys.argv:
        keep(*sys.argv[sys.argv.index("--keep") + 1:])
    faults = []
    for page in sorted(p for pattern in PAGES for p in ROOT.glob(pattern)):
        name, text = str(page.relative_to(ROOT)), page.read_text()
        made = filled(text)
        if made != text and "--check" in sys.argv:
            faults.append(f"{name}: a block of numbers is not what docs/measured says (docs/make_numbers.py makes it)")
        elif made != text:
            page.write_text(made)
        faults += strangers(name, made)
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    sys.exit(1 if faults else 0)


main()
