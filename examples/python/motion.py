# Step by step: a cube of jelly is let go and swings to its rest, while the script looks on and stops it when it likes.
import hextools
import numpy as np

cube = hextools.build(np.ones((12, 12, 12), dtype=np.uint8), spacing=(5, 5, 5), segments={1: "jelly"},
                      materials={"jelly": {"young_kpa": 5, "poisson": 0.45, "density_kg_m3": 1000}})
scene = {
    "solve": {"kind": "dynamics"},
    "dynamics": {"step_s": 0.01, "duration_s": 1.0, "integrator": "bdf2"},
    "damping": {"mass_per_s": 15},
    "fix": [{"name": "plate", "halfspace": {"point_mm": [0, 0, -2], "normal": [0, 0, -1]}}],
    "gravity": {"m_s2": [6, 0, 0]},
}
motion = hextools.motion(cube, scene, level=2)
top = np.argmax(motion.nodes @ [0, 0, 1])
furthest = 0.0
for state in motion:
    furthest = max(furthest, state["displacement"][top, 0])
    if state["time"] > 0.1 and state["energies"]["kinetic"] < 1e-4 * state["energies"]["strain"]:
        break
print(f"the top swung by {furthest:.2f} mm; after {state['time']:.2f} s it is at {state['displacement'][top, 0]:.2f} mm")
