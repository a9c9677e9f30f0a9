"""Measure the estimates of all scenes; one line of JSON each.

usage: measure.py FOLDER WORD [GRADING]     (WORD: only scenes whose name has it; drawn:FIRST:COUNT: those of drawn.py)
"""
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

import scenes

MOST_SECONDS = int(os.environ.get("MOST_SECONDS", 300))  # each

def run(*command):
    return subprocess.run(["timeout", str(MOST_SECONDS), *command], capture_output=True, text=True, env=dict(os.environ, OMP_NUM_THREADS="1"))


def measure(folder, grading, number, scene):
    name, body, materials, tables, law, ratio = scene
    volume, lattice, file, report = (folder / f"{number:02}{end}" for end in (".nrrd", ".hexmesh", ".toml", ".json"))
    file.write_text(tables.replace("[solve]", f'[solve]\ngrading = "{grading}"', 1))
    told = {"name": name, "body": body.name, "load": name.split(", ", 1)[1], "law": law, "poisson": ratio}
    if body.phantom:
        made = run("hexscan", "-q", "phantom", *body.phantom, "-o", volume, "--force")
    else:
        body.write(volume)
        made = None
    steps = [["hexmesh", "-q", "build", volume, *(w for m in materials for w in ("--material", m)), "-o", lattice, "--force"],
             ["hexbench", "-q", "estimates", lattice, file, "--accuracies", "0.1,0.03", "-o", report, "--force"]]
    for step in ([made] if made and made.returncode else []) or (run(*s) for s in steps):
        if step.returncode:
            said = step.stderr.strip().replace(f"{folder}/", "").splitlines()
            return {**told, "failed": f"took more than {MOST_SECONDS} s" if step.returncode == 124 else said[-1] if said else str(step.returncode)}
    for path in (volume, lattice):
        path.unlink()
    return {**told, **json.loads(report.read_text())}


def main():
    folder, word, grading = pathlib.Path(sys.argv[1]), sys.argv[2], (sys.argv[3:] or ["off"])[0]
    if word.startswith("drawn:"):
        import drawn
        first, count = map(int, word.split(":")[1:])
        wanted = zip(range(first, first + count), map(drawn.scene, range(first, first + count)))
    else:
        wanted = [(n, s) for n, s in enumerate(scenes.scenes()) if word in s[0]]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for row in pool.map(lambda s: measure(folder, grading, *s), wanted):
            print(json.dumps(row), flush=True)
            print(row["name"], row.get("failed", ""), file=sys.stderr)


main()
