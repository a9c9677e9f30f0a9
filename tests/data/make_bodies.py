"""Make the bodies that are no phantoms of hexscan: NRRD, made of formulas.

usage: make_bodies.py HEXSCAN     (the liver is hexscan's phantom of 6 mm)
"""
import gzip
import math
import pathlib
import subprocess
import sys

BODIES = pathlib.Path(__file__).resolve().parent / "bodies"


def write(name, extent, directions, origin, segments, label):
    nx, ny, nz = extent
    triple = lambda v: "(" + ",".join(f"{x:.12g}" for x in v) + ")"  # noqa: E731
    head = ["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior", f"sizes: {nx} {ny} {nz}",
            "space directions: " + " ".join(map(triple, directions)), "space origin: " + triple(origin), "encoding: gzip"]
    for n, segment in enumerate(segments):
        head += [f"Segment{n}_LabelValue:={n + 1}", f"Segment{n}_Name:={segment}", f"Segment{n}_ID:=s{n + 1}", f"Segment{n}_Layer:=0"]
    data = bytes(label(i, j, k) for k in range(nz) for j in range(ny) for i in range(nx))
    (BODIES / f"{name}.nrrd").write_bytes("\n".join(head).encode() + b"\n\n" + gzip.compress(data, 9, mtime=0))


def turned(spacing, degrees):
    """Axes turned about z, then about x."""
    a, b = math.radians(degrees), math.radians(degrees / 2)
    axes = [(math.cos(a), math.sin(a) * math.cos(b), math.sin(a) * math.sin(b)),
            (-math.sin(a), math.cos(a) * math.cos(b), math.cos(a) * math.sin(b)), (0, -math.sin(b), math.cos(b))]
    return [tuple(s * x for x in axis) for s, axis in zip(spacing, axes)]


def cut_block(i, j, k):
    """A block with a corner cut off and a slit, around a stiff ball; voxels are 2 x 2.5 x 3 mm."""
    if i + 1.3 * j + 1.6 * k > 40 or (j in (5, 6) and i > 14):
        return 0
    return 2 if (2 * i - 14) ** 2 + (2.5 * j - 16) ** 2 + (3 * k - 15) ** 2 < 81 else 1


def main(hexscan):
    subprocess.run([hexscan, "-q", "phantom", "liver", "--spacing", "6", "-o", BODIES / "liver.nrrd", "--force"], check=True)
    write("block", (24, 12, 10), turned((2, 2.5, 3), 30), (-120, 35, 7), ["tissue", "stone"], cut_block)
    straight = [(5, 0, 0), (0, 5, 0), (0, 0, 5)]
    write("bar", (24, 6, 6), straight, (2.5, -12.5, -12.5), ["bar"], lambda i, j, k: 1)
    write("blocks", (14, 12, 12), straight, (2.5, 2.5, 2.5), ["below", "above"],
          lambda i, j, k: 1 if k < 6 else 2 * int(3 <= i < 10 and 2 <= j < 10))
    write("cylinder", (14, 14, 16), straight, (-32.5, -32.5, 2.5), ["cylinder"],
          lambda i, j, k: int((i - 6.5) ** 2 + (j - 6.5) ** 2 <= 49))


main(sys.argv[1])
