"""Twins: a body is deformed by a scene, all but its shape is forgotten, and hexfit finds the displacement from what is seen of that.

usage: twins.py FOLDER     (with body.hexmesh; a table in Markdown goes to standard output)
"""
import csv
import json
import pathlib
import random
import re
import struct
import subprocess
import sys
import time

SEEN = (100, 75, 50, 25, 10)  # percent of the surface, from the front


def run(*command, check=True):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if check and done.returncode:
        sys.exit(done.stderr.strip())
    return done


def truth_scene(lattice):
    """Another law, held and pulled at the example's places by larger patches, and pushed."""
    places = [p.strip() for p in re.findall(r"point_mm = (\[[^\]]*\])", run("hexsolve", lattice, "--example").stdout)]
    pull = re.search(r"by_mm = (\[[^\]]*\])", run("hexsolve", lattice, "--example").stdout)[1]
    name = json.loads(run("hexmesh", "info", lattice, "--json").stdout)["segments"][0]["name"]
    return f"""[solve]
law = "neo-hookean"
[material."{name}"]
young_kpa = 4
poisson = 0.45
[[fix]]
point_mm = {places[1]}
radius_mm = 25
[[displace]]
point_mm = {places[3]}
radius_mm = 15
by_mm = {pull}
[[force]]
point_mm = {places[0]}
radius_mm = 25
newton = [0.08, -0.12, 0.04]
"""


def read_stl(path):
    """Points and triangles of a binary STL."""
    data = path.read_bytes()
    numbers, points, triangles = {}, [], []
    for n in range(struct.unpack_from("<I", data, 80)[0]):
        corners = struct.unpack_from("<12f", data, 84 + 50 * n)[3:]
        triangle = []
        for at in (corners[0:3], corners[3:6], corners[6:9]):
            if at not in numbers:
                numbers[at] = len(points)
                points.append(at)
            triangle.append(numbers[at])
        triangles.append(triangle)
    return points, triangles


def write_part(path, points, triangles, percent, noise):
    """The triangles in front of the rest, with noise of so many mm in each coordinate."""
    random.seed(1)
    front = lambda t: sum(points[p][1] for p in t)
    kept = sorted(triangles, key=front)[: len(triangles) * percent // 100]
    with open(path, "w") as file:
        file.write(f"OFF\n{len(points)} {len(kept)} 0\n")
        for p in points:
            file.write("{} {} {}\n".format(*(x + random.gauss(0, noise) for x in p)))
        for t in kept:
            file.write("3 {} {} {}\n".format(*t))


def read_nodes(path):
    with open(path) as file:
        return [tuple(float(row[k]) for k in ("x", "y", "z", "ux", "uy", "uz")) for row in csv.DictReader(file)]


def write_markups(folder, nodes):
    """Five places inside, far from each other, before and now."""
    middle = [sum(n[d] for n in nodes) / len(nodes) for d in range(3)]
    apart = lambda a, b: sum((a[d] - b[d]) ** 2 for d in range(3))
    chosen = [min(nodes, key=lambda n: apart(n, middle))]
    while len(chosen) < 5:
        far = max(nodes, key=lambda n: min(apart(n, c) for c in chosen))
        inside = [0.75 * far[d] + 0.25 * middle[d] for d in range(3)]
        chosen.append(min(nodes, key=lambda n: apart(n, inside)))
    for name, at in (("before", lambda n: n[:3]), ("now", lambda n: [n[d] + n[d + 3] for d in range(3)])):
        points = [{"id": str(i), "label": f"P{i}", "position": list(at(n))} for i, n in enumerate(chosen)]
        markup = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": points}
        (folder / f"{name}.mrk.json").write_text(json.dumps({"markups": [markup]}))


def rigid_error(report, nodes):
    pose = report["pose"]
    errors = []
    for n in nodes:
        moved = [sum(row[d] * n[d] for d in range(3)) + row[3] for row in pose]
        errors.append(sum((moved[d] - n[d] - n[d + 3]) ** 2 for d in range(3)) ** 0.5)
    return sum(errors) / len(errors)


def main():
    folder = pathlib.Path(sys.argv[1])
    lattice, truth = folder / "body.hexmesh", folder / "truth.hexresult"
    (folder / "truth.toml").write_text(truth_scene(lattice))
    run("hexsolve", "-q", lattice, folder / "truth.toml", "--level", 0, "--set", 'solve.error_estimate="off"', "--force", "-o", truth)
    run("hexexport", "-q", truth, "--csv", folder / "truth.csv", "--segmentation", folder / "now.seg.nrrd", "--surface", folder / "now.stl",
        "--force")
    nodes = read_nodes(folder / "truth.csv")
    write_markups(folder, nodes)
    points, triangles = read_stl(folder / "now.stl")
    body = json.loads(run("hexmesh", "info", lattice, "--json").stdout)["segments"][0]["name"]
    marks = ["--landmarks", folder / "before.mrk.json", folder / "now.mrk.json"]

    print("| what is seen | noise | error inside, mean | a rigid motion leaves | target off, mean | least Jacobian | time |")
    print("|---|---|---|---|---|---|---|")
    rows = [("segmentation", 0, [folder / "now.seg.nrrd", "--segment", body], [])]
    for percent in SEEN:
        part = folder / f"part_{percent}.off"
        write_part(part, points, triangles, percent, 1)
        rows.append((f"{percent} % of the surface", 1, [part, "--body", body, "--part"], []))
        if percent == 50:
            rows.append((f"{percent} % and five landmarks", 1, [part, "--body", body, "--part"], marks))
    for what, noise, target, more in rows:
        start = time.time()
        done = run("hexfit", "-q", lattice, *target, *more, "--no-spread", "--report", folder / "fit.json", "--force", "-o",
                   folder / "fit.hexresult", check=False)
        seconds = time.time() - start
        if done.returncode not in (0, 5):
            sys.exit(done.stderr.strip())
        report = json.loads((folder / "fit.json").read_text())
        off = json.loads(run("hexbench", "compare", folder / "fit.hexresult", folder / "truth.csv").stdout)
        print(f"| {what} | {noise} mm | {off['distance_mm_mean']:.2f} mm{' (exit 5)' if done.returncode else ''} | "
              f"{rigid_error(report, nodes):.2f} mm | {report['matches'][0]['target_to_body']['mean_mm']:.2f} mm | "
              f"{report['min_jacobian']:.2f} | {seconds:.0f} s |", flush=True)


main()
