"""Limits of smooth bodies by quadratic elements of CalculiX (Debian's calculix-ccx) on meshes that get finer: limits.json.

Beam: 160 x 40 x 40 mm, one end clamped, 1000 kg/m^3 under 9.81 m/s^2 across; half of it, C3D20R, graded to the clamp.
Cylinder: radius 50 mm, ends clamped and moved together; half the height, axisymmetric CAX8R, graded to the edge.
Punch: radius 12, 20 mm high, with a round end of radius 20, clamped, moved into a cylinder of radius 30, 30 mm high, held
below; CAX8R, graded to where they meet, without friction. The force.
Values on three meshes, each twice as fine as the one before, and what they tend to: Aitken's extrapolation.
"""
import json
import pathlib
import re

import calculix

HERE = pathlib.Path(__file__).resolve().parent


def graded(count, length, ratio):
    """Places of 2 count + 1 nodes, elements growing by `ratio` from first to last."""
    sizes = [ratio ** (n / max(1, count - 1)) for n in range(count)]
    ends = [length * sum(sizes[:n]) / sum(sizes) for n in range(count + 1)]
    return sorted(ends + [(a + b) / 2 for a, b in zip(ends, ends[1:])])


def last(dat, components):
    """The last row of printed displacements."""
    rows = [l.split() for l in dat.split("displacements")[-1].splitlines() if re.match(r"\s+\d+\s", l)]
    return [float(x) for x in rows[-1][1:1 + components]]


def steps(law, boundary):
    if law == "cauchy":
        return f"*STEP\n*STATIC\n{boundary}"
    return f"*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1., 1e-4, 0.1\n*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-7\n{boundary}"


def beam(young_kpa, poisson, law, n):
    """Displacement of the middle of the free end along z and x [mm]; n elements across z."""
    xs, ys, zs = graded(2 * n, 160, 6), graded(max(1, n // 2), 20, 1), graded(n, 40, 1)
    node, elements = {}, []
    at = lambda i, j, k: node.setdefault((i, j, k), len(node) + 1)  # noqa: E731
    order = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2), (1, 0, 0), (2, 1, 0), (1, 2, 0),
             (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2), (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    for i in range(0, len(xs) - 1, 2):
        for j in range(0, len(ys) - 1, 2):
            for k in range(0, len(zs) - 1, 2):
                elements.append([at(i + a, j + b, k + c) for a, b, c in order])
    rows = ["*NODE"] + [f"{n}, {xs[i]:.12g}, {ys[j]:.12g}, {zs[k]:.12g}" for (i, j, k), n in node.items()]
    rows.append("*ELEMENT, TYPE=C3D20R, ELSET=E")
    for number, e in enumerate(elements):
        rows += [f"{number + 1}, " + ", ".join(map(str, e[:10])) + ",", ", ".join(map(str, e[10:]))]
    rows += ["*MATERIAL, NAME=M", calculix.material(young_kpa, poisson, law).rstrip(), "*DENSITY\n1e-9", "*SOLID SECTION, ELSET=E, MATERIAL=M"]
    clamp = [n for (i, _, _), n in node.items() if i == 0]
    middle = [n for (_, j, _), n in node.items() if j == 0]
    tip = node[len(xs) - 1, 0, (len(zs) - 1) // 2]
    boundary = ["*BOUNDARY"] + [f"{n}, 1, 3" for n in clamp] + [f"{n}, 2, 2" for n in middle] + ["*DLOAD", "E, GRAV, 9810, 0, 0, -1"]
    rows += ["*NSET, NSET=TIP", f"{tip},", steps(law, "\n".join(boundary)), "*NODE PRINT, NSET=TIP, FREQUENCY=1000", "U", "*END STEP"]
    u = last(calculix.run("\n".join(rows) + "\n"), 3)
    return [u[2], u[0]]


def axisymmetric(along_r, along_z, first=0):
    """Numbers of nodes, and nodes of elements, by place in a grid."""
    node, elements = {}, {}
    at = lambda i, k: node.setdefault((i, k), first + len(node) + 1)  # noqa: E731
    order = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    for i in range(0, along_r - 1, 2):
        for k in range(0, along_z - 1, 2):
            elements[i, k] = [at(i + a, k + b) for a, b in order]
    return node, elements


def solid(name, elements, first, material):
    rows = [f"*ELEMENT, TYPE=CAX8R, ELSET={name}"] + [f"{first + m + 1}, " + ", ".join(map(str, e)) for m, e in enumerate(elements)]
    return rows + [f"*MATERIAL, NAME={name}", material.rstrip(), f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]


def punch(depth, n):
    """Force of the punch, E 10 kPa, nu 0.45, on the cylinder, 20 kPa, 0.3 [N]; n elements along each."""
    end, radius, height, base_radius, base_height = 20, 12, 20, 30, 30
    rb = graded(n, radius, 4) + [radius + r for r in graded(n // 3, base_radius - radius, 3)[1:]]
    zb = [-z for z in reversed(graded(n, base_height, 12))]
    rp, zp = graded(n, radius, 4), graded(n, height, 12)
    below, base = axisymmetric(len(rb), len(zb))
    above, tip = axisymmetric(len(rp), len(zp), len(below))
    rise = lambda r: end - (end ** 2 - r ** 2) ** 0.5  # noqa: E731
    rows = ["*NODE"] + [f"{m}, {rb[i]:.12g}, {zb[k]:.12g}, 0" for (i, k), m in below.items()]
    rows += [f"{m}, {rp[i]:.12g}, {rise(rp[i]) + zp[k] / height * (height - rise(rp[i])):.12g}, 0" for (i, k), m in above.items()]
    rows += solid("B", base.values(), 0, calculix.material(20, 0.3, "cauchy"))
    rows += solid("P", tip.values(), len(base), calculix.material(10, 0.45, "cauchy"))
    rows += ["*SURFACE, NAME=SB"] + [f"{m + 1}, S3" for m, (i, k) in enumerate(base) if k == len(zb) - 3 and rb[i] < radius]
    rows += ["*SURFACE, NAME=SP"] + [f"{len(base) + m + 1}, S1" for m, (_, k) in enumerate(tip) if k == 0]
    rows += ["*SURFACE INTERACTION, NAME=I", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", "80",
             "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE", "SP, SB"]
    held = [m for (_, k), m in below.items() if k == 0]
    moved = [m for (_, k), m in above.items() if k == len(zp) - 1]
    axis = [m for (i, k), m in below.items() if i == 0 and k > 0] + [m for (i, k), m in above.items() if i == 0 and k < len(zp) - 1]
    rows += ["*NSET, NSET=MOVED"] + [f"{m}," for m in moved] + ["*STEP, INC=1000", "*STATIC", "0.1, 1., 1e-6, 0.1", "*BOUNDARY"]
    rows += [f"{m}, 1, 1" for m in axis] + [f"{m}, 1, 2" for m in held]
    for m in moved:
        rows += [f"{m}, 1, 1", f"{m}, 2, 2, {-depth:.12g}"]
    rows += ["*NODE PRINT, NSET=MOVED, TOTALS=ONLY, FREQUENCY=1000", "RF", "*END STEP"]
    sums = re.findall(r"total force[^\n]*\n\s*([^\n]+)", calculix.run("\n".join(rows) + "\n"))
    slice_of_circle = 2 / 360  # that CalculiX makes of such elements
    return [abs(float(sums[-1].split()[1])) / slice_of_circle]


def cylinder(height, compression, poisson, law, n):
    """How much the radius grows half way [mm]; n elements along the radius and half the height."""
    rs = [50 - r for r in reversed(graded(n, 50, 8))]
    zs = [height / 2 - z for z in reversed(graded(n, height / 2, 8))]
    node, elements = axisymmetric(len(rs), len(zs))
    rows = ["*NODE"] + [f"{n}, {rs[i]:.12g}, {zs[k]:.12g}, 0" for (i, k), n in node.items()]
    rows += solid("E", elements.values(), 0, calculix.material(100, poisson, law))
    boundary = ["*BOUNDARY"]
    for (i, k), number in node.items():
        if k == len(zs) - 1:
            boundary += [f"{number}, 1, 1", f"{number}, 2, 2, {-compression * height / 2:.12g}"]
        elif i == 0:
            boundary.append(f"{number}, 1, 1")
        if k == 0:
            boundary.append(f"{number}, 2, 2")
    rows += ["*NSET, NSET=RIM", f"{node[len(rs) - 1, 0]},", steps(law, "\n".join(boundary)), "*NODE PRINT, NSET=RIM, FREQUENCY=1000", "U", "*END STEP"]
    return last(calculix.run("\n".join(rows) + "\n"), 2)[:1]


def limit(values):
    """Aitken's: what three values tend to whose differences shrink by one factor."""
    a, b, c = values
    return c - (c - b) ** 2 / ((c - b) - (b - a)) if abs(c - b) < abs(b - a) else c


def case(name, measure, meshes, components):
    values = [measure(n) for n in meshes]
    out = {"name": name, "meshes": meshes}
    for c, component in enumerate(components):
        column = [v[c] for v in values]
        out[component] = {"values": column, "limit": float(f"{limit(column):.6g}")}
    print(name, {k: v["limit"] for k, v in out.items() if isinstance(v, dict)}, flush=True)
    return out


def main():
    found = []
    for young, poisson, law in ((100, 0.3, "cauchy"), (100, 0.45, "cauchy"), (100, 0.49, "cauchy"), (100, 0.499, "cauchy"),
                                (300, 0.3, "green-lagrange"), (300, 0.45, "green-lagrange")):
        found.append(case(f"beam, {law}, E {young}, nu {poisson}", lambda n: beam(young, poisson, law, n),
                          [4, 8, 16] if law == "cauchy" else [3, 6, 12], ["tip_z_mm", "tip_x_mm"][:1 if law == "cauchy" else 2]))
    for height in (30, 43, 50, 100, 200):
        found.append(case(f"cylinder, cauchy, height {height}, 10 %", lambda n: cylinder(height, 0.1, 0.49, "cauchy", n), [16, 32, 64], ["growth_mm"]))
    for depth in (1, 1.5, 2):
        found.append(case(f"punch, cauchy, depth {depth}", lambda n: punch(depth, n), [9, 18, 36], ["force_n"]))
    (HERE / "limits.json").write_text(json.dumps(found, indent=1) + "\n")


main()
