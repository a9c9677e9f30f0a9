"""Errors of graded cells and of cells alike; Markdown.

usage: measure.py FOLDER
"""
import json
import os
import pathlib
import statistics
import subprocess
import sys

OFFSETS = (pathlib.Path(__file__).parent.parent / "positions.txt").read_text().split()

HELD = """
[[fix]]
name = "right end"
point_mm = [-99, -1, -15]
radius_mm = {radius}
[[fix]]
name = "back"
point_mm = [-48, 48, -15]
radius_mm = {radius}
[[fix]]
name = "lower end"
point_mm = [-50, -13, -50]
radius_mm = {radius}
"""
PULLED = """
[[displace]]
name = "left end"
point_mm = [99, -19, 7]
radius_mm = {radius}
by_mm = [0, -28.284271, -28.284271]
"""
WEIGHT = """
[gravity]
m_s2 = [0, 0, -9.81]
"""
SCENES = [("pulled at patches of 10 mm", HELD + PULLED, 10), ("pulled at patches of 20 mm", HELD + PULLED, 20),
          ("weight, patches of 10 mm", HELD + WEIGHT, 10)]


def run(*words):
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)


def levels(folder, scene, grading):
    """Of each level, the rows of all positions."""
    file, report = os.path.join(folder, "scene.toml"), os.path.join(folder, "report.json")
    with open(file, "w") as f:
        f.write(f'[solve]\nstrain = "cauchy"\nerror_estimate = "look"\ngrading = "{grading}"\n{scene}')
    out = {}
    for n in range(len(OFFSETS)):
        run("hexbench", "-q", "estimates", os.path.join(folder, f"{n}.hexmesh"), file, "--least-cells", "100", "-o", report, "--force")
        for row in json.load(open(report))["levels"]:
            out.setdefault(row["level"], []).append(row)
    return out


def main():
    folder = sys.argv[1]
    scan = os.path.join(folder, "liver.nrrd")
    run("hexscan", "-q", "phantom", "liver", "--spacing", "2", "-o", scan, "--force")
    for n, offset in enumerate(OFFSETS):
        run("hexmesh", "-q", "build", scan, "-o", os.path.join(folder, f"{n}.hexmesh"), "--offset", offset, "--material", "*:young_kpa=100,poisson=0.3",
            "--force")
    print("The phantom of 2 mm, E = 100 kPa, nu = 0.3, small strain; errors against level 0, medians (least to largest) of eight positions of the lattice\n")
    print("| scene | cells | finest [mm] | unknowns | mean error [mm] | largest error [mm] | estimate over mean error |")
    print("|---|---|---|---|---|---|---|")
    for name, scene, radius in SCENES:
        for words, grading in (("alike", "off"), ("graded", "scene")):
            for level, rows in sorted(levels(folder, scene.format(radius=radius), grading).items(), reverse=True):
                mean = [r["mean_mm"]["error"] for r in rows]
                largest = statistics.median(r["max_mm"]["error"] for r in rows)
                ratio = [r["mean_mm"]["estimate"] / r["mean_mm"]["error"] for r in rows if r["mean_mm"]["estimate"] is not None]
                told = f"{statistics.median(ratio):.2f} ({min(ratio):.2f} to {max(ratio):.2f})" if ratio else "unknown"
                print(f"| {name} | {words} | {2 << level} | {statistics.median(r['unknowns'] for r in rows):.0f} | "
                      f"{statistics.median(mean):.3f} ({min(mean):.3f} to {max(mean):.3f}) | {largest:.2f} | {told} |")


main()
