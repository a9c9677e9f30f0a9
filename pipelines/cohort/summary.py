#!/usr/bin/env python3
"""One table of a cohort: summary.tsv, summary.json and summary.html, from what is in its folder.

usage: summary.py FOLDER     (exit code 1 if a case failed, 3 if one was not begun)
"""
import csv
import glob
import html
import json
import os
import re
import sys

OUTPUTS = ["_dseg.nrrd", "_dseg.json", "_desc-lattice_mesh.hexmesh", "_desc-lattice_mesh.json", "_desc-pull_scene.toml",
           "_desc-pull_result.hexresult", "_desc-pull_result.json", "_desc-pull_report.html", "_desc-pull_report.json"]
COLUMNS = ["participant_id", "status", "flags", "volume_ml", "level", "cells", "dofs", "newton_iterations", "linear_iterations",
           "strain_energy_n_mm", "pull_n", "error_mean_mm", "min_jacobian", "inverted_cells", "misfit_mm", "seconds"]
NOT_BEGUN = "not begun"
FLAT = 0.1  # a cell this small against its rest volume deserves a look
MISFIT_MM = 1  # so does a condition met no better than this


def read(path):
    try:
        with open(path) as file:
            return json.load(file)
    except (OSError, ValueError):
        return None


def reason_of(folder, case):
    """The step that failed and what its tool said: steps remove the logs of those after them."""
    logs = sorted(glob.glob(f"{glob.escape(folder)}/logs/sub-{case}_*.log"))
    if not logs:
        return NOT_BEGUN
    with open(logs[-1], errors="replace") as file:
        lines = [line.strip() for line in file if line.strip()]
    step = re.sub(r".*_\d-(\w+)\.log", r"\1", logs[-1])
    errors = [line for line in lines if "error:" in line]
    words = [line for line in lines if re.search("[A-Za-z]", line)]
    return f"{step}: {errors[-1]}" if errors else f"{step}: not finished" + (f" ({words[-1]})" if words else "")


def row_of(folder, case):
    stem = f"{folder}/sub-{case}/sub-{case}"
    row = dict.fromkeys(COLUMNS, "")
    row["participant_id"] = f"sub-{case}"
    lattice = read(stem + "_desc-lattice_mesh.json")
    if lattice:
        row["volume_ml"] = round(sum(s.get("volume_ml", 0) for s in lattice["Report"]["segments"]), 1)
    solution = read(stem + "_desc-pull_result.json")
    if solution is None or not all(os.path.exists(stem + name) for name in OUTPUTS):
        row["status"] = "failed"
        row["flags"] = reason_of(folder, case)
        return row
    report = solution["Report"]
    row.update(status="solved", level=report["lattice"]["level"], cells=report["lattice"]["cells"], dofs=report["lattice"]["dofs"])
    for key in ["newton_iterations", "linear_iterations", "inverted_cells"]:
        row[key] = report[key]
    for key in ["strain_energy_n_mm", "min_jacobian"]:
        row[key] = f"{report[key]:.4g}"
    error = report["error_estimate_mm"]["mean"]
    row["error_mean_mm"] = "" if error is None else f"{error:.2g}"
    row["pull_n"] = f"{max((sum(x * x for x in c['reaction_n']) ** 0.5 for c in report['conditions']), default=0):.4g}"
    misfit = max((c["misfit_mm"] for c in report["conditions"]), default=0)
    row["misfit_mm"] = f"{misfit:.2g}"
    row["seconds"] = f"{report['seconds']['total']:.1f}"
    flags = []
    if report["inverted_cells"] > 0:
        flags.append(f"{report['inverted_cells']} cells inverted")
    elif report["min_jacobian"] < FLAT:
        flags.append("cells nearly flat")
    if misfit > MISFIT_MM:
        flags.append(f"a condition misses its place by {misfit:.2g} mm")
    if error is None:
        flags.append("no error estimate")
    flags += [w for w in report["warnings"] if "inverted" not in w and "flat" not in w]
    row["flags"] = "; ".join(flags)
    return row


def page(folder, rows):
    cells = ["<tr>" + "".join(f"<th>{c}</th>" for c in ["pictures", *COLUMNS]) + "</tr>"]
    for row in rows:
        case = row["participant_id"]
        pictures = ""
        for view in ["oblique", "axial"]:
            name = f"{case}/{case}_desc-pull_view-{view}.png"
            if os.path.exists(f"{folder}/{name}"):
                pictures += f'<a href="{case}/{case}_desc-pull_report.html"><img src="{name}" alt="{case}, {view}"></a>'
        values = "".join(f"<td>{html.escape(str(row[c]))}</td>" for c in COLUMNS)
        cells.append(f'<tr class="{row["status"]}"><td>{pictures}</td>{values}</tr>')
    solved = sum(row["status"] == "solved" for row in rows)
    return f"""<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>Cohort</title>
<style>body {{ font: 14px sans-serif; margin: 2em }} table {{ border-collapse: collapse }}
td, th {{ border: 1px solid #ccc; padding: 4px 8px; text-align: left; vertical-align: top }}
img {{ height: 120px; margin-right: 4px }} .failed {{ background: #fdecea }}</style>
<h1>{len(rows)} cases, {solved} solved, {len(rows) - solved} failed</h1>
<table>
{chr(10).join(cells)}
</table></html>
"""


def replace(path, write):
    with open(path + ".new", "w", newline="") as file:
        write(file)
    os.replace(path + ".new", path)


def main():
    folder = sys.argv[1]
    rows = [row_of(folder, case) for case in read(f"{folder}/cases.json")["cases"]]

    def table(file):
        writer = csv.DictWriter(file, COLUMNS, delimiter="\t", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)

    replace(f"{folder}/summary.tsv", table)
    replace(f"{folder}/summary.json", lambda file: json.dump(rows, file, indent=1))
    replace(f"{folder}/summary.html", lambda file: file.write(page(folder, rows)))
    for row in rows:
        print(f"{row['participant_id']:<24} {row['status']:<7} {row['flags']}")
    failed = sum(row["status"] == "failed" for row in rows)
    print(f"{len(rows)} cases, {failed} failed: {folder}/summary.html")
    sys.exit(3 if any(row["flags"] == NOT_BEGUN for row in rows) else 1 if failed else 0)


main()
