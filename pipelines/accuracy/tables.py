"""Tables of what accuracy and effects cost, from the JSON files that bench.sh leaves in a folder; Markdown.

usage: tables.py FOLDER
"""
import json
import pathlib
import re
import statistics
import sys


def read(folder, name):
    path = folder / (name + ".json")
    return json.loads(path.read_text()) if path.exists() else None


def markdown(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows])


def table(header, rows):
    print(markdown(header, [["" if cell is None else f"{cell:.3g}" if isinstance(cell, float) else cell for cell in row] for row in rows]) + "\n")


def own_error(row):
    """Each method against its own limit: cells tend to the voxels, tetrahedra to the smooth surface."""
    return row.get("to_voxels_mm_mean" if "cells" in row["method"] else "to_tets_mm_mean")


def laws(rows):
    return list(dict.fromkeys(r["law"] for r in rows))


def references(about):
    print("### References\n")
    table(["law", "reference", "nodes", "seconds", "from a quarter as many [mm]", "from the voxels [mm]", ""],
          [[r["law"], r["reference"], r["nodes"], r["seconds"], r.get("from_a_quarter_as_many_mm"), r.get("from_voxels_mm"),
            "" if r["converged"] else "not converged: " + r["reason"].split(";")[0]] for r in about["references"]])


def levels(rows):
    print("### Cells, level by level\n")
    sharpest = min(r["tolerance"] for r in rows)
    chosen = [r for r in rows if r["method"] == "cells" and r["tolerance"] == sharpest]
    table(["law", "cell [mm]", "cells", "dofs", "total [s]", "memory [MB]", "to the voxels [mm]", "to smooth tetrahedra [mm]", "worst [mm]", "difference of laws [mm]"],
          [[r["law"], r["size_mm"], r.get("elements"), r.get("dofs"), r.get("total_s"), r.get("memory_mb"), r.get("to_voxels_mm_mean"),
            r.get("to_tets_mm_mean"), r.get("to_voxels_mm_max"), r.get("law_difference_mm")] for r in chosen])


def cheapest(rows, method_is, error, limit):
    fit = [r for r in rows if method_is(r["method"]) and r["converged"] and (error(r) or 1e9) <= limit]
    return min(fit, key=lambda r: r["total_s"], default=None)


def races(rows):
    """For an error, the least time of each kind; against the smooth reference, which is the same for all."""
    print("### Least seconds for a mean error to smooth quadratic tetrahedra (cells also to their own limit)\n")
    kinds = [("cells", lambda m: m == "cells"), ("averaged cells", lambda m: m == "uniform cells"),
             ("tetrahedra", lambda m: m.startswith("tetrahedra") and "graded" not in m),
             ("tetrahedra, smaller at supports", lambda m: m.startswith("tetrahedra, graded")), ("cells, graded", lambda m: m == "cells, graded"),
             ("cells, condensed", lambda m: m == "cells, condensed")]
    common = lambda r: r.get("to_tets_mm_mean")  # noqa: E731
    out = []
    for law in laws(rows):
        own = [r for r in rows if r["law"] == law]
        for limit in (3, 2, 1, 0.7, 0.5, 0.3, 0.2, 0.1):
            best = [cheapest(own, method_is, common, limit) for _, method_is in kinds]
            limit_of_cells = cheapest(own, kinds[0][1], own_error, limit)
            seconds = [b["total_s"] if b else None for b in best] + [limit_of_cells["total_s"] if limit_of_cells else None]
            ratio = [f"{s / seconds[4]:.2f}" if s and seconds[4] else "" for s in seconds[2:4]]
            out.append([law, str(limit)] + seconds + ratio)
    table(["law", "error [mm]"] + [k for k, _ in kinds] + ["cells to the voxels", "tetrahedra / graded cells", "graded / graded cells"], out)


def convergence(rows):
    """Where more unknowns do not mean less error."""
    print("### Does the error fall with resolution?\n")
    out = []
    sharpest = min(r["tolerance"] for r in rows)
    for law in laws(rows):
        for method in dict.fromkeys(r["method"] for r in rows):
            series = sorted((r["dofs"], own_error(r), r["held"]) for r in rows
                            if r["method"] == method and r["law"] == law and r["tolerance"] == sharpest and r["converged"] and own_error(r) is not None)
            if not series:
                continue
            rises = [f"{a[1]:.3f} to {b[1]:.3f} at {b[0]} dofs (held nodes {a[2]} to {b[2]})" for a, b in zip(series, series[1:]) if b[1] > a[1]]
            out.append([law, method, f"{series[0][1]:.3f} to {series[-1][1]:.3f}", "always" if not rises else "rises: " + "; ".join(rises)])
    table(["law", "method", "mean error, coarsest to finest [mm]", "falls"], out)
    print("Where the error of tetrahedra rises, a patch is the reason: the nodes within its radius are others on every mesh, "
          "and its outline moves by up to half an edge. Cells hold the same area on every level.\n")


def motions(rows):
    print("### Motion: steps per second, and how far from equilibrium after 2 s\n")
    table(["method", "iterations", "nodes", "steps/s", "from equilibrium [mm]"],
          [[r["method"], r["iterations"], r["nodes"], r["steps_per_second"], own_error(r)] for r in rows])


def effects(rows):
    print("### Effects, one added after the other\n")
    table(["effect added", "time over linear", "memory [MB]", "Newton steps", "changes by, mean [mm]", "at most [mm]"],
          [[r["effect"], r["time_over_linear"], r["memory_mb"], r["newton_iterations"], r.get("change_mm", {}).get("mean"),
            r.get("change_mm", {}).get("max")] for r in rows])


def motion(bench):
    print(f"### Motion on one thread of {bench['peak_gflops_of_a_thread']:.0f} GFLOP/s, 10 conjugate gradient iterations a step\n")
    table(["nodes", "cells", "steps/s", "229 points", "1,455", "5,541"],
          [[l["nodes"], l["cells"], l["steps_per_second"]] + [s["steps_per_second"] for s in l["surfaces"]] for l in bench["levels"]])
    plain = next(s["ms_per_step"] for s in bench["solvers"] if s["solver"] == "cg" and s["iterations"] == 10)
    table(["solver", "iterations", "time over cg 10", "off the converged motion"],
          [[s["solver"], s["iterations"] or "converged", s["ms_per_step"] / plain, s["relative_difference"]] for s in bench["solvers"]])
    table(["rotation", "ms a step"], [[r["rotation"], r["ms_per_step"]] for r in bench["rotations"]])


def of_positions(folder, cells="alike"):
    """Level -> law -> errors of all positions of the lattice [mm].

    cells: alike, condensed (and softly held, alike) or graded
    """
    errors = {}
    for line in (folder / "positions.jsonl").read_text().splitlines():
        row = json.loads(line)
        for level in row["found"]["levels"] if row["cells"] == cells else []:
            assert level["converged"], row
            errors.setdefault(level["level"], {}).setdefault(row["strain"], []).append(level["mean_mm"]["error"])
    return errors


def positions(errors, cells):
    print(f"### Mean error over eight positions of the lattice, {cells} [mm]\n")
    table(["level", "law", "median", "least", "largest"],
          [[level, law, statistics.median(found), min(found), max(found)]
           for level, laws in errors.items() for law, found in laws.items()])


def volumes(folder):
    """Lit or not -> median of the seconds that a picture takes."""
    told = [float(s) for s in re.findall(r"drawn in ([0-9.]+) s", (folder / "volume.txt").read_text())]
    half = len(told) // 2  # as bench.sh draws them
    return {"lit": statistics.median(told[:half]), "flat": statistics.median(told[half:])}


def volume(seconds):
    print("### A volume of 512 x 512 pixels and 101 planes\n")
    table(["surfaces", "pictures a second"], [[name, 1 / s] for name, s in seconds.items()])


def main(folder):
    accuracy = read(folder, "accuracy")
    references(accuracy["about"])
    levels(accuracy["equilibria"])
    races(accuracy["equilibria"])
    convergence(accuracy["equilibria"])
    if accuracy["motions"]:
        motions(accuracy["motions"])
    effects(read(folder, "effects")["effects"])
    motion(read(folder, "motion"))
    positions(of_positions(folder), "cells alike")
    positions(of_positions(folder, "condensed"), "condensed cells")
    positions(of_positions(folder, "graded"), "graded cells")
    volume(volumes(folder))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
