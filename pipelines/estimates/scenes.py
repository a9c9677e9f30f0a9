"""Bodies and scenes that estimates of the error are tried on: everything here is made on the spot.

A body has voxels, a long axis from `low` to `high` (two points on its surface), a size across and a stiffness. Each is
held and loaded in several ways, each way under another law and Poisson's ratio.
"""
import dataclasses
import math
import random
import struct


@dataclasses.dataclass
class Body:
    name: str
    low: tuple  # a place of the surface at one end [mm]
    high: tuple  # and at the other
    across: float  # size across [mm]
    phantom: list = None  # arguments of hexscan phantom
    voxels: callable = None  # or a function of the index, with extent and spacing
    extent: tuple = None
    spacing: float = None
    young_kpa: str = "100"
    bends: float = 1  # how much softer than a solid bar across

    def length(self):
        return math.dist(self.low, self.high)

    def write(self, path):
        """A NRRD of what `voxels` says."""
        nx, ny, nz = self.extent
        labels = bytes(self.voxels(i, j, k) for k in range(nz) for j in range(ny) for i in range(nx))
        s = self.spacing
        names = {v for v in labels if v}
        head = ["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior", f"sizes: {nx} {ny} {nz}",
                f"space directions: ({s},0,0) (0,{s},0) (0,0,{s})", "space origin: (0,0,0)", "encoding: raw"]
        for n, label in enumerate(sorted(names)):
            head += [f"Segment{n}_LabelValue:={label}", f"Segment{n}_Name:=material {label}", f"Segment{n}_ID:=s{label}", f"Segment{n}_Layer:=0"]
        path.write_bytes("\n".join(head).encode() + b"\n\n" + struct.pack(f"{len(labels)}B", *labels))


def branched(i, j, k):
    """A trunk with three branches."""
    def near(a, b, r):
        p, d = (i - a[0], j - a[1], k - a[2]), tuple(y - x for x, y in zip(a, b))
        t = max(0, min(1, sum(x * y for x, y in zip(p, d)) / sum(y * y for y in d)))
        return sum((x - t * y) ** 2 for x, y in zip(p, d)) <= r * r
    fork = (24, 20, 20)
    return int(near((4, 20, 20), fork, 6) or near(fork, (44, 34, 22), 4) or near(fork, (46, 8, 14), 4.5) or near(fork, (44, 20, 36), 3.5))


def lumps(i, j, k):
    """Four balls that overlap."""
    balls = [((12, 14, 14), 11), ((26, 18, 13), 10), ((37, 13, 16), 9), ((45, 17, 12), 7)]
    return int(any(math.dist((i, j, k), c) <= r for c, r in balls))


RANDOM = random.Random(1)
HOLES = [(tuple(RANDOM.uniform(0, n) for n in (48, 20, 20)), RANDOM.uniform(1.5, 3)) for _ in range(60)]


def sponge(i, j, k):
    return int(all(math.dist((i, j, k), c) > r for c, r in HOLES))


BODIES = [
    Body("beam", (-80, 0, 0), (80, 0, 0), 40, phantom=["beam", "--spacing", "2.5"]),
    Body("turned beam", (-75, 0, 27), (75, 0, -27), 40, phantom=["beam", "--set", "rotate_y=20", "--spacing", "4"]),
    Body("slender beam", (-80, 0, 0), (80, 0, 0), 16, phantom=["beam", "--set", "width=16", "--set", "height=16", "--spacing", "1.6"]),
    Body("sheet", (-50, 0, 0), (50, 0, 0), 6, phantom=["sheet", "--set", "height=6", "--set", "width=60", "--spacing", "1.5"]),
    Body("cylinder", (0, 0, -45), (0, 0, 45), 60, phantom=["cylinder", "--set", "radius=30", "--set", "height=90", "--spacing", "2.5"]),
    Body("sphere", (0, 0, -40), (0, 0, 40), 70, phantom=["sphere", "--spacing", "2.5"]),
    Body("c-shape", (-32, 28, 0), (32, -26, 0), 16, phantom=["c-shape", "--spacing", "1.4"], bends=4),
    Body("liver", (-99, -1, -15), (99, -19, 7), 60, phantom=["liver", "--spacing", "3"]),
    Body("lumps", (2, 28, 28), (103, 34, 24), 34, voxels=lumps, extent=(56, 32, 30), spacing=2),
    Body("branches", (0, 40, 40), (99, 12, 26), 10, voxels=branched, extent=(54, 42, 42), spacing=2),
    Body("sponge", (0, 20, 20), (94, 20, 20), 34, voxels=sponge, extent=(48, 20, 20), spacing=2),
    Body("thick layers", (0, 20, 20), (94, 20, 20), 40, voxels=lambda i, j, k: 1 + k // 5 % 2, extent=(48, 20, 20), spacing=2,
         young_kpa="20 200"),
    Body("thin layers", (0, 20, 20), (94, 20, 20), 40, voxels=lambda i, j, k: 1 + k % 2, extent=(48, 20, 20), spacing=2,
         young_kpa="20 200"),
]

LAWS = ['strain = "cauchy"', 'strain = "corotational"', 'law = "neo-hookean"', 'strain = "cauchy"', 'strain = "corotational"',
        'strain = "green-lagrange"', 'law = "stable-neo-hookean"']
RATIOS = [0.3, 0.45, 0.49, 0.3, 0.4, 0.4999]


def vector(v):
    return "[" + ", ".join(f"{x:.6g}" for x in v) + "]"


def held(body, part=0.06):
    """The end `low`, as far as a part of the length."""
    axis = [(h - l) / body.length() for l, h in zip(body.low, body.high)]
    point = [l + part * body.length() * a for l, a in zip(body.low, axis)]
    return f'[[fix]]\nname = "end"\nhalfspace = {{ point_mm = {vector(point)}, normal = {vector([-a for a in axis])} }}\n'


def patch(body, kind, place, by=None, part=0.3):
    text = f'[[{kind}]]\nname = "{kind} patch"\npoint_mm = {vector(place)}\nradius_mm = {part * body.across:.6g}\nmax_distance_mm = 20\n'
    return text + (f"by_mm = {vector(by)}\n" if by else "")


def loads(body):
    """Ways to load a body: name and tables of the scene."""
    length, across, young = body.length(), body.across, float(body.young_kpa.split()[0])
    axis = [(h - l) / length for l, h in zip(body.low, body.high)]
    side = max(((0, 0, 1), (0, 1, 0)), key=lambda s: 1 - abs(sum(a * b for a, b in zip(axis, s))))
    # Gravity and forces that bend a bar of this size by a twelfth of its length, and press it by a twentieth at most.
    bend = young * across ** 2 / length ** 3 / 18 * 1e3  # m/s^2 at 1000 kg/m^3
    press = young / 20 / length * 1e3
    g = min(bend, press) / body.bends
    force = young * 1e-3 * across ** 4 / length ** 2 / 48
    force = min(force, young * 1e-3 * across ** 2 / 60) / body.bends
    squeeze = min(0.05, 0.3 * math.pi ** 2 / 12 * (across / 2 / length) ** 2) / body.bends  # strain, well below that of buckling
    pull = [0.1 * length * s + 0.02 * length * a for s, a in zip(side, axis)]
    yield "pull", patch(body, "fix", body.low) + patch(body, "displace", body.high, pull)
    yield "pull, end held", held(body) + patch(body, "displace", body.high, pull, 0.2)
    yield "gravity", held(body) + f"[gravity]\nm_s2 = {vector([-g * s for s in side])}\n"
    yield "gravity along", held(body, 0.15) + f"[gravity]\nm_s2 = {vector([0.7 * g * (a - 0.5 * s) for a, s in zip(axis, side)])}\n"
    yield "pressure", held(body) + patch(body, "force", body.high, None, 0.4) + f"pressure_kpa = {young * squeeze:.6g}\n"
    yield "force", held(body) + patch(body, "force", body.high) + f"newton = {vector([-force * s for s in side])}\n"
    edge = body.spacing or float(body.phantom[-1])
    plate = [h + 0.02 * length * a for h, a in zip(body.high, axis)]
    by = [-(0.02 + squeeze) * length * a for a in axis]
    yield "contact", (held(body) + f'[[contact]]\nname = "plate"\nplane = {{ point_mm = {vector(plate)}, normal = {vector([-a for a in axis])} }}\n'
                      f"by_mm = {vector(by)}\nstiffness_n_mm = {young * 1e-3 * edge * 5:.4g}\n")


def materials(body, ratio):
    """Arguments of hexmesh build --material."""
    young = body.young_kpa.split()
    names = ["*"] if len(young) == 1 else [f"material {n + 1}" for n in range(len(young))]
    return [f"{name}:young_kpa={e},poisson={ratio},density_kg_m3=1000" for name, e in zip(names, young)]


def scenes():
    """Name, body, materials, tables of the scene."""
    number = 0
    for body in BODIES:
        for load, tables in loads(body):
            law, ratio = LAWS[number % len(LAWS)], RATIOS[number % len(RATIOS)]
            if "green-lagrange" in law:
                ratio = min(ratio, 0.4)  # its volumetric term is integrated in full
            number += 1
            yield f"{body.name}, {load}", body, materials(body, ratio), f"[solve]\n{law}\n" + tables, law.split('"')[1], ratio
