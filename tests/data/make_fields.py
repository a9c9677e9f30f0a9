"""Solve every case of cases.json by CalculiX (Debian's calculix-ccx) and leave its field in fields/.

usage: make_fields.py [WORD]     (only cases whose name has it)
"""
import collections
import gzip
import json
import pathlib
import sys
import tomllib

import calculix

HERE = pathlib.Path(__file__).resolve().parent


def materials_of(texts):
    """--material's texts: name -> E [kPa], nu, density [kg/m^3]."""
    out = {}
    for text in texts:
        name, keys = text.split(":")
        value = dict(k.split("=") for k in keys.split(","))
        out[name] = float(value["young_kpa"]), float(value["poisson"]), float(value.get("density_kg_m3", 1000))
    return out


def main(word):
    reactions_file = HERE / "fields/reactions.json"
    reactions = json.loads(reactions_file.read_text()) if reactions_file.exists() else {}
    for case in json.loads((HERE / "cases.json").read_text()):
        name = case["name"]
        if word not in name:
            continue
        scene = tomllib.loads((HERE / "scenes" / (case["scene"] + ".toml")).read_text())
        apart = scene["contact"][0]["between"][0] if "contact" in scene else None
        mesh = calculix.Mesh(calculix.read_body(HERE / "bodies" / (case["body"] + ".nrrd")), apart)
        scene["solve"].update(case.get("solve", {}))
        materials = materials_of(case["materials"])
        u, forces = (calculix.unload(mesh, materials, scene) if "loaded" in scene
                     else calculix.solve(mesh, materials, scene, case.get("steps", 1)))
        reactions[name] = {c["name"]: [float(f"{x:.7g}") for x in f] for c, f in zip(calculix.conditions_of(scene), forces)}
        rows = ["node,x,y,z,ux,uy,uz"]
        at_place = collections.Counter(mesh.place.values())  # two where segments touch, which a place does not tell apart
        rows += [f"{n}," + ",".join(f"{x:.9g}" for x in (*mesh.place[n], *u[n])) for n in sorted(u)[::2] if at_place[mesh.place[n]] == 1]
        with open(HERE / f"fields/{name}.csv.gz", "wb") as file, gzip.GzipFile("", "wb", 9, file, 0) as packed:
            packed.write(("\n".join(rows) + "\n").encode())
        print(name, len(mesh.elements), "voxels,", len(u), "nodes, largest", max(max(map(abs, v)) for v in u.values()), "mm", flush=True)
    reactions_file.write_text(json.dumps(reactions, indent=1) + "\n")


main(sys.argv[1] if len(sys.argv) > 1 else "")
