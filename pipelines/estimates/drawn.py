"""Bodies and scenes drawn by lot, so that estimates are tried on what nobody chose: thin walls, slits, necks, pores,
stiff skins and inclusions in any direction, under each kind of load. A number is a scene, the same one always.
"""
import math
import random

import numpy

import scenes


def rotation(draw):
    """A random rotation matrix."""
    q = numpy.array([draw.gauss(0, 1) for _ in range(4)])
    w, x, y, z = q / numpy.linalg.norm(q)
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def segment(p, a, b):
    """Distances of points (…, 3) from a segment."""
    a, d = numpy.array(a, float), numpy.subtract(b, a).astype(float)
    t = numpy.clip((p - a) @ d / (d @ d), 0, 1)
    return numpy.linalg.norm(p - a - t[..., None] * d, axis=-1)


def box(p, center, half):
    return numpy.all(numpy.abs(p - numpy.array(center, float)) <= numpy.array(half, float), axis=-1)


# Each is a function of places (…, 3) in a box of the half sizes that it names, of a voxel's edge and of the lot; it
# gives labels, 0 outside. Lengths are in mm, a body's largest is about 80.
def bar(p, voxel, draw):
    return box(p, (0, 0, 0), (40, draw.uniform(4, 14), draw.uniform(4, 14)))


def ellipsoid(p, voxel, draw):
    axes = numpy.array([40, draw.uniform(10, 35), draw.uniform(10, 35)])
    return numpy.sum((p / axes) ** 2, axis=-1) <= 1


def tube(p, voxel, draw):
    r, wall = draw.uniform(9, 18), draw.uniform(1.6, 4) * voxel
    across = numpy.linalg.norm(p[..., 1:], axis=-1)
    return (abs(p[..., 0]) <= 40) & (across <= r) & (across >= r - wall)


def shell(p, voxel, draw):
    axes, wall = numpy.array([40, draw.uniform(15, 30), draw.uniform(15, 30)]), draw.uniform(1.8, 4) * voxel
    return (numpy.sum((p / axes) ** 2, axis=-1) <= 1) & (numpy.sum((p / (axes - wall)) ** 2, axis=-1) > 1)


def curved_sheet(p, voxel, draw):
    bow, half = draw.uniform(0, 0.012), draw.uniform(0.9, 2) * voxel
    return (abs(p[..., 0]) <= 40) & (abs(p[..., 1]) <= 22) & (abs(p[..., 2] - bow * p[..., 0] ** 2) <= half)


def helix(p, voxel, draw):
    turns, r, thick = draw.uniform(0.8, 1.8), draw.uniform(12, 20), draw.uniform(3, 6)
    t = numpy.linspace(0, 1, 40)
    line = numpy.stack([80 * t - 40, r * numpy.cos(2 * math.pi * turns * t), r * numpy.sin(2 * math.pi * turns * t)], axis=-1)
    near = numpy.full(p.shape[:-1], 1e9)
    for a, b in zip(line[:-1], line[1:]):
        near = numpy.minimum(near, segment(p, a, b))
    return near <= thick


def frame(p, voxel, draw):
    half, thick, width = draw.uniform(18, 30), draw.uniform(3, 7), draw.uniform(4, 10)
    return box(p, (0, 0, 0), (40, half, width)) & ~box(p, (0, 0, 0), (40 - thick, half - thick, 99))


def necked(p, voxel, draw):
    """Two blocks that overlap in little."""
    neck, off = draw.uniform(1, 3) * voxel, draw.uniform(6, 14)
    return box(p, (-20 + neck / 4, -off / 2, 0), (20 + neck / 4, 12, 12)) | box(p, (20 - neck / 4, off / 2 + 12, 0), (20 + neck / 4, 12, 12))


def slit(p, voxel, draw):
    """A block with a cut of one voxel or two."""
    at, deep, wide = draw.uniform(-12, 12), draw.uniform(0.3, 0.85), draw.uniform(0.6, 1.1) * voxel
    half = (40, draw.uniform(12, 22), draw.uniform(8, 16))
    cut = (abs(p[..., 0] - at) <= wide) & (p[..., 1] >= half[1] * (1 - 2 * deep))
    return box(p, (0, 0, 0), half) & ~cut


def porous(p, voxel, draw):
    out = box(p, (0, 0, 0), (40, 15, 15))
    for _ in range(draw.randint(30, 70)):
        center = [draw.uniform(-40, 40), draw.uniform(-15, 15), draw.uniform(-15, 15)]
        out &= numpy.linalg.norm(p - center, axis=-1) > draw.uniform(2.5, 6)
    return out


def truss(p, voxel, draw):
    corners = [(x, y, z) for x in (-36, -12, 12, 36) for y in (-12, 12) for z in (-12, 12)]
    thick, near = draw.uniform(1.6, 3.5), numpy.full(p.shape[:-1], 1e9)
    for n, a in enumerate(corners):
        for b in corners[n + 1:]:
            if math.dist(a, b) <= 24.1 or (math.dist(a, b) < 34.2 and draw.random() < 0.3):
                near = numpy.minimum(near, segment(p, a, b))
    return near <= thick


def lumps(p, voxel, draw):
    out = numpy.zeros(p.shape[:-1], bool)
    x = -30
    while x < 36:
        r = draw.uniform(7, 15)
        out |= numpy.linalg.norm(p - [x, draw.uniform(-4, 4), draw.uniform(-4, 4)], axis=-1) <= r
        x += r * draw.uniform(0.9, 1.4)
    return out


def skinned(p, voxel, draw):
    axes, skin = numpy.array([40, draw.uniform(14, 25), draw.uniform(14, 25)]), draw.uniform(1.2, 2.5) * voxel
    return (numpy.sum((p / axes) ** 2, axis=-1) <= 1) + (numpy.sum((p / (axes - skin)) ** 2, axis=-1) <= 1).astype(int)


def inclusions(p, voxel, draw):
    out = box(p, (0, 0, 0), (40, 16, 16)).astype(int)
    for _ in range(draw.randint(3, 9)):
        center = [draw.uniform(-34, 34), draw.uniform(-12, 12), draw.uniform(-12, 12)]
        out[(numpy.linalg.norm(p - center, axis=-1) <= draw.uniform(3, 9)) & (out > 0)] = 2
    return out


def branches(p, voxel, draw):
    fork = numpy.array([draw.uniform(-15, 5), 0, 0])
    near = segment(p, (-36, 0, 0), fork) - draw.uniform(5, 9)
    for _ in range(draw.randint(2, 4)):
        end = fork + [draw.uniform(15, 35), draw.uniform(-22, 22), draw.uniform(-22, 22)]
        near = numpy.minimum(near, segment(p, fork, end) - draw.uniform(3, 6))
    return near <= 0


SHAPES = [bar, ellipsoid, tube, shell, curved_sheet, helix, frame, necked, slit, porous, truss, lumps, skinned, inclusions, branches]


def largest_part(labels):
    """What hangs together by faces with the voxel from which most does."""
    todo, best = labels > 0, None
    while todo.any() and (best is None or todo.sum() > best.sum()):
        part = numpy.zeros_like(todo)
        part[tuple(numpy.argwhere(todo)[0])] = True
        size = 0
        while size != part.sum():
            size = part.sum()
            for axis in range(3):
                for step in (1, -1):
                    moved = numpy.roll(part, step, axis)  # bodies have a border of nothing
                    part |= moved & todo
        if best is None or part.sum() > best.sum():
            best = part
        todo &= ~part
    return numpy.where(best, labels, 0)


def drawn_body(draw, shape):
    """A body of this shape in a random direction, and its ends along another one."""
    voxel = draw.uniform(1.5, 3)
    turn = rotation(draw) if draw.random() < 0.7 else numpy.eye(3)
    reach = 62 if turn[0, 1] else 48
    count = int(2 * reach / voxel)
    index = numpy.stack(numpy.meshgrid(*[numpy.arange(count)] * 3, indexing="ij"), axis=-1)
    places = (index - (count - 1) / 2) * voxel
    labels = largest_part(numpy.asarray(shape(places @ turn, voxel, draw)).astype(int))
    filled = numpy.argwhere(labels > 0)
    low = filled.min(axis=0) - numpy.array([draw.randint(0, 7) for _ in range(3)])  # the lattice anywhere on it
    high = filled.max(axis=0) + 1
    extent = high - low
    kept = numpy.zeros(extent, int)
    first = numpy.maximum(low, 0)
    kept[tuple(slice(a - b, None) for a, b in zip(first, low))] = labels[tuple(slice(a, b) for a, b in zip(first, high))]
    solid = numpy.argwhere(kept > 0)
    along = turn @ numpy.array([1.0, 0, 0]) if draw.random() < 0.7 else rotation(draw)[0]
    heights = solid @ along
    ends = [solid[int(heights.argmin())] * voxel, solid[int(heights.argmax())] * voxel]
    across = math.sqrt(len(solid) * voxel ** 3 / max(numpy.linalg.norm(ends[1] - ends[0]), voxel))
    contrast = 10 ** draw.uniform(-2, 2)
    two = kept.max() > 1
    return scenes.Body(shape.__name__, tuple(ends[0]), tuple(ends[1]), across, voxels=lambda i, j, k: int(kept[i, j, k]),
                       extent=tuple(extent), spacing=voxel, young_kpa=f"20 {20 * contrast:.4g}" if two else "20",
                       bends=draw.uniform(1, 6)), kept


def more_loads(body, filled, draw):
    """Beside scenes.loads(): what turns, hangs, is pinched or pressed by a ball."""
    length = body.length()
    axis = [(h - l) / length for l, h in zip(body.low, body.high)]
    middle = [(l + h) / 2 for l, h in zip(body.low, body.high)]
    degrees = draw.uniform(5, 70)
    place = lambda: list(filled[int((filled @ rotation(draw)[0]).argmax())] * body.spacing)  # on the surface
    yield "twist", scenes.held(body) + (f'[[displace]]\nname = "turned"\nhalfspace = {{ point_mm = {scenes.vector([h - 0.06 * length * a for h, a in zip(body.high, axis)])}, '
                                        f'normal = {scenes.vector(axis)} }}\nrotate = {{ axis = {scenes.vector(axis)}, degrees = {degrees:.3g}, about_mm = {scenes.vector(middle)} }}\n')
    sideways = scenes.vector([0.04 * length * x for x in rotation(draw)[0]])
    apart = numpy.minimum(*[numpy.linalg.norm(filled * body.spacing - end, axis=1) for end in (body.low, body.high)])
    aside = list(filled[int(apart.argmax())] * body.spacing)
    yield "pinch", (scenes.patch(body, "fix", body.low) + scenes.patch(body, "displace", body.high, [-0.05 * length * a for a in axis])
                    + scenes.patch(body, "displace", aside).replace("displace patch", "third") + f"by_mm = {sideways}\n")
    young, weight = 20, draw.uniform(0.3, 1) * 20 / 40 / length * 1e3 / body.bends
    down = rotation(draw)[0]
    hung = "".join(scenes.patch(body, "fix", place()).replace("fix patch", f"hung {n}") for n in range(3))
    yield "hung", hung + f"[gravity]\nm_s2 = {scenes.vector([weight * d for d in down])}\n"
    radius = 0.4 * body.across
    center = [h + 0.9 * radius * a for h, a in zip(body.high, axis)]
    yield "ball", scenes.held(body) + (f'[[contact]]\nname = "ball"\nsphere = {{ center_mm = {scenes.vector(center)}, radius_mm = {radius:.4g} }}\n'
                                       f'by_mm = {scenes.vector([-0.03 * length * a for a in axis])}\nstiffness_n_mm = {young * 1e-3 * body.spacing * 5:.4g}\n')


LAWS = ['strain = "auto"', 'strain = "cauchy"', 'strain = "corotational"', 'law = "neo-hookean"', 'law = "stable-neo-hookean"',
        'strain = "auto"', 'strain = "corotational"', 'strain = "green-lagrange"']


def scene(number):
    """Name, body, materials, tables of the scene, law, Poisson's ratio: as those of scenes.scenes()."""
    draw = random.Random(number)
    shape = draw.choice(SHAPES)
    body, kept = drawn_body(draw, shape)
    filled = numpy.argwhere(kept > 0)
    load, tables = draw.choice([*scenes.loads(body), *more_loads(body, filled, draw)])
    law = draw.choice(LAWS)
    ratio = draw.choice([0, 0.3, 0.4, 0.45, 0.49, 0.49, 0.4999])
    if "green-lagrange" in law:
        ratio = min(ratio, 0.4)
    name = f"{number}: {shape.__name__}, {load}"
    return name, body, scenes.materials(body, ratio), f"[solve]\n{law}\n" + tables, law.split('"')[1], ratio

