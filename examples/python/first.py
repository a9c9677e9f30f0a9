# From a numpy array to a displacement: a bar of gelatine that hangs from its upper end.
import hextools
import numpy as np

labels = np.zeros((10, 10, 40), dtype=np.uint8)
labels[1:9, 1:9, 1:39] = 1
bar = hextools.build(labels, spacing=(5, 5, 5), materials={1: {"young_kpa": 10, "poisson": 0.45, "density_kg_m3": 1000}})
top = {"name": "top", "halfspace": {"point_mm": [0, 0, 192], "normal": [0, 0, 1]}}
result = hextools.solve(bar, {"fix": [top], "gravity": {"m_s2": [0, 0, -9.81]}}, level=1)
print(f"the lower end comes down by {-result.displacement_at([[22.5, 22.5, 2.5]])[0, 2]:.2f} mm")
