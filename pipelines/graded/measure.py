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
END = """
[[fix]]
name = "end"
box_mm = [-1000, -80, -1000, 1000, -1000, 1000]
"""
THIRD = """
[[fix]]
name = "third"
halfspace = { point_mm = [-30, 0, 0], normal = [-1, 0, 0] }
"""
SCENES = [("pulled at patches of 10 mm", (HELD + PULLED).format(radius=10)), ("pulled at patches of 20 mm", (HELD + PULLED).format(radius=20)),
          ("weight, patches of 10 mm", (HELD + WEIGHT).format(radius=10)), ("weight, an end held", END + WEIGHT), ("weight, a third held", THIRD + WEIGHT)]
ALIKE, GRADED = {"grading": "off"}, {"grading": "scene"}
PAPERS = {"stiffness": "exact", "supports": "area"}
BENDING, CONDENSED = {"stiffness": "incompatible"}, {"stiffness": "condensed"}
SOFT = {"supports": "soft"}
KINDS = [(name + words, cells | PAPERS | solve)
         for words, solve in (("", {}), (", bending", BENDING), (", condensed", CONDENSED), (", soft", SOFT), (", condensed and soft", CONDENSED | SOFT))
         for name, cells in (("alike", ALIKE), ("graded", GRADED))]
# A sheet as thick as a voxel that is cut out: half way through the lobe that is pulled, with its sides along voxels and askew.
CUT = "height=2 length=60 width=60 rotate_y=90"
FISSURES = [("a fissure", CUT + " shift_z=31 shift_x=39", ("tie", "split")),
            ("a fissure less deep", CUT + " shift_z=41 shift_x=55", ("tie", "split")),
            ("an oblique fissure", CUT + " rotate_z=35 shift_z=31 shift_x=39", ("split",))]


def run(*words):
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)


def build(folder, scan, *words):
    """Lattices of all positions."""
    for n, offset in enumerate(OFFSETS):
        run("hexmesh", "-q", "build", *scan, "-o", os.path.join(folder, f"{n}.hexmesh"), "--offset", offset, "--material", "*:young_kpa=100,poisson=0.3",
            "--force", *words)


def levels(folder, scene, solve):
    """Of each level, the rows of all positions."""
    file, report = os.path.join(folder, "scene.toml"), os.path.join(folder, "report.json")
    with open(file, "w") as f:
        f.write("\n".join(["[solve]"] + [f'{key} = "{word}"' for key, word in {"strain": "cauchy", "error_estimate": "look", **solve}.items()] + [scene]))
    out = {}
    for n in range(len(OFFSETS)):
        run("hexbench", "-q", "estimates", os.path.join(folder, f"{n}.hexmesh"), file, "--least-cells", "100", "-o", report, "--force")
        for row in json.load(open(report))["levels"]:
            out.setdefault(row["level"], []).append(row)
    return out


def tell(name, words, of_levels):
    for level, rows in sorted(of_levels.items(), reverse=True):
        mean = [r["mean_mm"]["error"] for r in rows]
        largest = statistics.median(r["max_mm"]["error"] for r in rows)
        ratio = [r["mean_mm"]["estimate"] / r["mean_mm"]["error"] for r in rows if r["mean_mm"]["estimate"] is not None]
        told = f"{statistics.median(ratio):.2f} ({min(ratio):.2f} to {max(ratio):.2f})" if ratio else "unknown"
        print(f"| {name} | {words} | {2 << level} | {statistics.median(r['unknowns'] for r in rows):.0f} | "
              f"{statistics.median(mean):.3f} ({min(mean):.3f} to {max(mean):.3f}) | {largest:.2f} | {told} |")


def main():
    folder = sys.argv[1]
    scan, sheet = (os.path.join(folder, name) for name in ("liver.nrrd", "sheet.nrrd"))
    run("hexscan", "-q", "phantom", "liver", "--spacing", "2", "-o", scan, "--force")
    build(folder, [scan])
    print("The phantom of 2 mm, E = 100 kPa, nu = 0.3, small strain; errors against level 0, medians (least to largest) of eight positions of the lattice\n")
    print("| scene | cells | finest [mm] | unknowns | mean error [mm] | largest error [mm] | estimate over mean error |")
    print("|---|---|---|---|---|---|---|")
    for name, scene in SCENES:
        for words, solve in KINDS:
            tell(name, words, levels(folder, scene, solve))
    name, scene = SCENES[0]
    for fissure, sizes, gaps_of_cells in FISSURES:
        run("hexscan", "-q", "phantom", "sheet", "--spacing", "2", *(word for size in sizes.split() for word in ("--set", size)), "-o", sheet, "--force")
        for gaps in gaps_of_cells:
            build(folder, [scan, sheet], "--material", "sheet:none", "--gaps", gaps)
            for words, solve in [kind for kind in KINDS if "bending" not in kind[0]] if gaps == "split" else KINDS[:1]:
                tell(f"{name}, {fissure}", f"{words}, {gaps}", levels(folder, scene, solve))


main()
