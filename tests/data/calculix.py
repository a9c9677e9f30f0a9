"""CalculiX on voxel bodies: every voxel one C3D8 brick; units mm, N, MPa, t.

Nothing here comes from hextools but the files that both read: a labelled volume and a scene.
"""
import dataclasses
import gzip
import math
import pathlib
import re
import subprocess
import tempfile

# Corners of C3D8 in index space, and its faces P1 to P6 by those corners.
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
FACES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
BEYOND = [(0, 0, -1), (0, 0, 1), (0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)]  # the voxel across each face


@dataclasses.dataclass
class Body:
    """A labelled volume: labels by voxel index, and the place of an index [mm]."""
    labels: dict
    names: dict
    origin: tuple
    directions: list  # of the three axes [mm a voxel]

    def position(self, index):
        return tuple(o + sum(i * d[c] for i, d in zip(index, self.directions)) for c, o in enumerate(self.origin))


def read_body(path):
    head, data = path.read_bytes().split(b"\n\n", 1)
    keys = dict(re.split(r":=?\s*", line, maxsplit=1) for line in head.decode().splitlines()[1:] if ":" in line)
    if "gz" in keys["encoding"]:
        data = gzip.decompress(data)
    nx, ny, nz = map(int, keys["sizes"].split())
    vectors = lambda text: [tuple(map(float, v.split(","))) for v in re.findall(r"\(([^)]*)\)", text)]  # noqa: E731
    wide = len(data) // (nx * ny * nz)
    labels = {(n % nx, n // nx % ny, n // (nx * ny)): int.from_bytes(data[wide * n:wide * (n + 1)], "little")
              for n in range(nx * ny * nz)}
    names = {int(keys[f"Segment{n}_LabelValue"]): keys[f"Segment{n}_Name"] for n in range(99) if f"Segment{n}_Name" in keys}
    return Body({i: l for i, l in labels.items() if l}, names, vectors(keys["space origin"])[0], vectors(keys["space directions"]))


class Mesh:
    """Bricks of a body; nodes at the corners of voxels, those of an apart segment its own."""

    def __init__(self, body, apart=None):
        self.body = body
        self.node, self.elements = {}, []
        for voxel in sorted(body.labels, key=lambda v: v[::-1]):
            is_apart = body.names[body.labels[voxel]] == apart
            corners = [(tuple(v + c for v, c in zip(voxel, corner)), is_apart) for corner in CORNERS]
            self.elements.append((voxel, [self.node.setdefault(c, len(self.node) + 1) for c in corners]))
        self.place = {n: body.position(tuple(c - 0.5 for c in corner)) for (corner, _), n in self.node.items()}
        self.outer = [(e, f) for e, (voxel, _) in enumerate(self.elements) for f, step in enumerate(BEYOND)
                      if tuple(v + s for v, s in zip(voxel, step)) not in body.labels]
        self.surface = sorted({self.elements[e][1][c] for e, f in self.outer for c in FACES[f]})

    def faces_of(self, segment):
        """Faces of a segment where it ends: (element, face)."""
        names = {voxel: self.body.names[label] for voxel, label in self.body.labels.items()}
        return [(e, f) for e, (voxel, _) in enumerate(self.elements) for f, step in enumerate(BEYOND)
                if names[voxel] == segment != names.get(tuple(v + s for v, s in zip(voxel, step)))]

    def face_center(self, element, face):
        places = [self.place[self.elements[element][1][c]] for c in FACES[face]]
        return tuple(sum(p[c] for p in places) / 4 for c in range(3))


def selects(where, point):
    """Whether a table of a scene takes a point of the surface."""
    if "halfspace" in where:
        plane = where["halfspace"]
        return sum((p - q) * n for p, q, n in zip(point, plane["point_mm"], plane["normal"])) >= 0
    return math.dist(point, where["point_mm"]) <= where["radius_mm"]


def conditions_of(scene):
    return scene.get("fix", []) + scene.get("displace", [])


def points_of(mesh, scene):
    """Of each condition the nodes that it takes."""
    return [[n for n in mesh.surface if selects(c, mesh.place[n])] for c in conditions_of(scene)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def turned(point, rotate, part):
    """Where a part of a rotation moves a point to."""
    angle = math.radians(rotate["degrees"]) * part
    axis = [a / math.hypot(*rotate["axis"]) for a in rotate["axis"]]
    r = [p - q for p, q in zip(point, rotate["about_mm"])]
    along = sum(a * b for a, b in zip(axis, r))
    return tuple(q + v * math.cos(angle) + c * math.sin(angle) + a * along * (1 - math.cos(angle))
                 for q, v, c, a in zip(rotate["about_mm"], r, cross(axis, r), axis))


def displacement(condition, point, part):
    to = turned(point, condition["rotate"], part) if "rotate" in condition else point
    return [t - p + part * b for t, p, b in zip(to, point, condition.get("by_mm", (0, 0, 0)))]


def material(young_kpa, poisson, law):
    young = young_kpa * 1e-3
    if law == "neo-hookean":  # mu/2 (I1 J^(-2/3) - 3) + kappa/2 (J - 1)^2
        mu, kappa = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))
        return f"*HYPERELASTIC, NEO HOOKE\n{mu / 2:.12g}, {2 / kappa:.12g}\n"
    return f"*ELASTIC\n{young:.12g}, {poisson}\n"


def contacts(mesh, materials, scene):
    """Surfaces that press on each other, all but hard: a thousandth of a voxel gives way as one does."""
    rows = []
    for number, contact in enumerate(scene.get("contact", [])):
        softest = min(young for young, *_ in materials.values()) * 1e-3
        for side, segment in enumerate(contact["between"]):
            rows.append(f"*SURFACE, NAME=F{number}_{side}, TYPE=ELEMENT")
            rows += [f"{e + 1}, S{f + 1}" for e, f in mesh.faces_of(segment)]
        rows += [f"*SURFACE INTERACTION, NAME=I{number}", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
                 f"{1e3 * softest / math.hypot(*mesh.body.directions[0]):.12g}",
                 f"*CONTACT PAIR, INTERACTION=I{number}, TYPE=SURFACE TO SURFACE", f"F{number}_0, F{number}_1"]
    return rows


def deck(mesh, materials, scene, steps=1, rest=None):
    """The input of CalculiX.

    @param materials: name of a segment -> its E [kPa], nu, density [kg/m^3]
    @param rest: places of the nodes at rest, if other than the body's: weight and pressures are then forces on nodes, as
                 they are on the body
    """
    solve = scene["solve"]
    law = solve.get("law") or solve["strain"]
    rows = ["*NODE, NSET=ALL"] + [f"{n}, " + ", ".join(f"{x:.9f}" for x in p) for n, p in (rest or mesh.place).items()]
    for label, name in mesh.body.names.items():
        rows.append(f"*ELEMENT, TYPE=C3D8, ELSET=S{label}")
        rows += [f"{e + 1}, " + ", ".join(map(str, nodes)) for e, (voxel, nodes) in enumerate(mesh.elements)
                 if mesh.body.labels[voxel] == label]
        young, poisson, density = materials.get(name, materials.get("*"))
        rows += [f"*MATERIAL, NAME=M{label}", material(young, poisson, law).rstrip(), f"*DENSITY\n{density * 1e-12:.12g}",
                 f"*SOLID SECTION, ELSET=S{label}, MATERIAL=M{label}"]
    rows += contacts(mesh, materials, scene)
    conditions, held = conditions_of(scene), points_of(mesh, scene)
    for number, nodes in enumerate(held):
        rows += [f"*NSET, NSET=C{number}"] + [f"{n}," for n in nodes]
    # CalculiX ends a step where its correction is small, not zero: large strain gets a step more, of the same loads.
    for part in [n / steps for n in range(1, steps + 1)] + ([1] if law != "cauchy" else []):
        is_linear = law == "cauchy" and "contact" not in scene
        rows += ["*STEP" + (", NLGEOM" if law != "cauchy" else "") + ("" if is_linear else ", INC=1000"), "*STATIC, SOLVER=SPOOLES"]
        if "contact" in scene:
            rows += ["0.1, 1., 1e-5, 0.1", "*CONTROLS, PARAMETERS=FIELD", "1e-8, 1e-8, , , 1e-8, 1e-8"]
        elif law != "cauchy":
            rows += ["0.25, 1., 1e-4, 1.", "*CONTROLS, PARAMETERS=FIELD", "1e-10, 1e-8, , , 1e-10, 1e-10"]
        rows.append("*BOUNDARY")
        for condition, nodes in zip(conditions, held):
            rows += [f"{n}, {d + 1}, {d + 1}, {u:.12g}" for n in nodes
                     for d, u in enumerate(displacement(condition, mesh.place[n], part))]
        if rest:
            rows.append("*CLOAD")
            rows += [f"{n}, {axis + 1}, {f * part:.12g}" for n, force in loads(mesh, materials, scene).items() for axis, f in enumerate(force)]
        if "gravity" in scene and not rest:
            g = scene["gravity"]["m_s2"]
            size = math.hypot(*g)
            rows.append("*DLOAD")
            rows += [f"S{label}, GRAV, {size * 1e3 * part:.12g}, " + ", ".join(f"{x / size:.12g}" for x in g) for label in mesh.body.names]
        for force in scene.get("force", []) if not rest else []:
            rows.append("*DLOAD")
            rows += [f"{e + 1}, P{f + 1}, {force['pressure_kpa'] * 1e-3 * part:.12g}" for e, f in mesh.outer
                     if selects(force, mesh.face_center(e, f))]
        rows += ["*NODE PRINT, NSET=ALL, FREQUENCY=1000", "U"]
        rows += [line for number in range(len(conditions)) for line in (f"*NODE PRINT, NSET=C{number}, TOTALS=ONLY, FREQUENCY=1000", "RF")]
        rows.append("*END STEP")
    return "\n".join(rows) + "\n"


def run(text):
    """What CalculiX prints (.dat), of its last step."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "deck"
        path.with_suffix(".inp").write_text(text)
        told = subprocess.run(["ccx", "deck"], cwd=folder, capture_output=True, text=True)
        if told.returncode or "*ERROR" in told.stdout:
            raise RuntimeError(told.stdout[-2000:])
        return path.with_suffix(".dat").read_text()


def loads(mesh, materials, scene):
    """Forces of weight and pressures by node [N]: an eighth of a brick's, a quarter of a face's."""
    out = {n: [0, 0, 0] for n in mesh.place}

    def add(nodes, force):
        for n in nodes:
            out[n] = [a + f / len(nodes) for a, f in zip(out[n], force)]

    a, b, c = mesh.body.directions
    volume = sum(x * y for x, y in zip(a, cross(b, c)))
    for voxel, nodes in mesh.elements:
        density = materials.get(mesh.body.names[mesh.body.labels[voxel]], materials.get("*"))[2]
        add(nodes, [density * 1e-9 * volume * g for g in scene.get("gravity", {"m_s2": (0, 0, 0)})["m_s2"]])
    for force in scene.get("force", []):
        for e, f in mesh.outer:
            if selects(force, mesh.face_center(e, f)):
                axis = next(n for n, step in enumerate(BEYOND[f]) if step)
                area = cross(mesh.body.directions[axis - 2], mesh.body.directions[axis - 1])
                nodes = [mesh.elements[e][1][corner] for corner in FACES[f]]
                add(nodes, [-force["pressure_kpa"] * 1e-3 * x * sum(BEYOND[f]) for x in area])
    return out


def solve(mesh, materials, scene, steps=1, rest=None):
    """Displacements by node [mm], and the force of each condition on its points [N]."""
    blocks = run(deck(mesh, materials, scene, steps, rest)).split("displacements")[-1]
    fields, *totals = re.split(r"total force[^\n]*\n", blocks)
    numbers = [line.split() for line in fields.splitlines() if re.match(r"\s+\d+\s", line)]
    u = {int(n): tuple(map(float, v)) for n, *v in numbers}
    assert len(u) == len(mesh.place)
    # CalculiX's total forces have loads at those nodes in them.
    applied = loads(mesh, materials, scene)
    return u, [tuple(float(total) - sum(applied[n][axis] for n in nodes) for axis, total in enumerate(t.split()[:3]))
               for t, nodes in zip(totals, points_of(mesh, scene))]


def unload(mesh, materials, scene):
    """Displacements to where the body is at rest, if it is as it is under [loaded]; and the forces of conditions then.

    Sellier's fixed point: what the loads move the body too far is taken off its rest.
    """
    loaded = scene["loaded"]
    forward = {"solve": scene["solve"], "fix": scene["fix"], "gravity": loaded.get("gravity", {"m_s2": (0, 0, 0)}),
               "force": loaded.get("force", [])}
    rest = dict(mesh.place)
    for _ in range(60):
        u, forces = solve(mesh, materials, forward, rest=rest)
        gap = {n: [r + d - p for r, d, p in zip(rest[n], u[n], place)] for n, place in mesh.place.items()}
        largest = max(abs(g) for of_node in gap.values() for g in of_node)
        print("  off by", largest, flush=True)
        if largest < 4e-6:
            break
        rest = {n: tuple(r - g for r, g in zip(rest[n], gap[n])) for n in rest}
    return {n: tuple(r - p for r, p in zip(rest[n], place)) for n, place in mesh.place.items()}, forces
