# What accuracy costs: a made-up organ with a stiff core, poked from one side, on one level after the other.
import hextools
import numpy as np

# An ellipsoid of 80 x 60 x 50 mm with a sphere inside, in voxels of 2 mm; z runs down the patient's axis.
index = np.stack(np.meshgrid(*(np.arange(n) for n in (44, 34, 29)), indexing="ij"), axis=-1)
place = 2.0 * (index - np.array([21.5, 16.5, 14.0]))
labels = np.zeros(index.shape[:3], dtype=np.uint16)
labels[np.sum((place / [40, 30, 25]) ** 2, axis=-1) < 1] = 1
labels[np.sum(((place - [15, 5, 0]) / 8) ** 2, axis=-1) < 1] = 2

organ = hextools.build(
    labels,
    spacing=(2, 2, 2),
    origin=-2.0 * np.array([21.5, 16.5, 14.0]),
    segments={1: "organ", 2: "core"},
    materials={"organ": {"young_kpa": 3, "poisson": 0.45, "density_kg_m3": 1050},
               "core": {"young_kpa": 30, "poisson": 0.45, "density_kg_m3": 1050}},
)
scene = {
    "solve": {"error_estimate": "look"},
    "fix": [{"name": "back", "halfspace": {"point_mm": [-30, 0, 0], "normal": [-1, 0, 0]}}],
    "displace": [{"name": "poke", "point_mm": [40, 0, 0], "radius_mm": 10, "by_mm": [-8, 0, 0]}],
}

print("level  cells  core moves [mm]  estimated error [mm]  seconds")
for level in (2, 1):
    result = hextools.solve(organ, scene, level=level)
    moved = result.displacement_at([[15, 5, 0]])[0]
    error = result.report["error_estimate_mm"]["mean"]
    told = "unknown" if error is None else f"{error:.3f}"
    print(f"{level:5}  {len(result.cells):5}  {np.linalg.norm(moved):15.3f}  {told:>20}  {result.costs['seconds']['solve']:7.2f}")
