"""What plans expect of time and memory, and what solutions then take; one line of JSON each.

usage: measure.py FOLDER WORD     (WORD: only scenes whose name has it)
"""
import dataclasses
import json
import os
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "estimates"))
import scenes

AUTO = ""
CAUCHY, COROTATIONAL, GREEN = ('strain = "cauchy"', 'strain = "corotational"', 'strain = "green-lagrange"')
NEO, STABLE = ('law = "neo-hookean"', 'law = "stable-neo-hookean"')
MOTION = "kind = \"dynamics\"\n[dynamics]\nstep_s = {}\nduration_s = {}\n"

# Body, edge of its voxels [mm] where it is not that of the estimates' scenes, load, law, Poisson's ratio, level or what is asked in its place
CASES = [
    ("liver", 2, "pull", CAUCHY, 0.3, 1), ("liver", 2, "pull", CAUCHY, 0.3, 0), ("liver", 1.5, "pull", COROTATIONAL, 0.45, 1),
    ("liver", 2, "gravity", NEO, 0.45, 1), ("liver", 2, "contact", AUTO, 0.3, 1), ("liver", 2, "gravity", COROTATIONAL, 0.3, 0),
    ("liver", 1.5, "force", AUTO, 0.49, 1), ("beam", 1.25, "force", COROTATIONAL, 0.3, 1), ("beam", 1.25, "pressure", CAUCHY, 0.49, 0),
    ("turned beam", 2, "pull, end held", GREEN, 0.3, 0), ("slender beam", 1, "gravity", AUTO, 0.45, 0), ("sheet", 1, "gravity", NEO, 0.4, 0),
    ("sheet", 0.75, "force", AUTO, 0.3, 1), ("cylinder", 1.5, "pressure", STABLE, 0.45, 0), ("cylinder", 2, "contact", NEO, 0.3, 1),
    ("sphere", 1.5, "gravity", AUTO, 0.3, 0), ("sphere", 2, "pull, end held", NEO, 0.4999, 1), ("c-shape", 0.8, "pull", COROTATIONAL, 0.3, 0),
    ("c-shape", 0.8, "contact", AUTO, 0.3, 1), ("lumps", None, "gravity along", AUTO, 0.45, 0), ("branches", None, "force", AUTO, 0.3, 0),
    ("thick layers", None, "pull", AUTO, 0.3, 0), ("liver", 3, "gravity", MOTION.format(0.02, 1), 0.3, 1),
    ("liver", 1.5, "gravity", NEO, 0.3, 1), ("liver", 2, "gravity", STABLE, 0.45, 0), ("liver", 2, "pull", CAUCHY + "\ngrading = \"scene\"", 0.3, 0),
    ("liver", 2, "pull", MOTION.format(0.01, 0.3), 0.45, 1), ("beam", 2, "gravity", NEO + "\n" + MOTION.format(0.02, 0.6), 0.3, 1),
    ("liver", 1.5, "pull", AUTO, 0.45, "accuracy 1"), ("liver", 1.5, "pull", AUTO, 0.45, "accuracy 0.1"), ("liver", 2, "gravity", AUTO, 0.3, "accuracy 0.2"),
    ("liver", 1.5, "pull, end held", CAUCHY, 0.49, "accuracy 0.05"), ("sphere", 1.5, "pressure", COROTATIONAL, 0.3, "accuracy 0.1"),
    ("slender beam", 1, "gravity", AUTO, 0.45, "accuracy 0.5"), ("cylinder", 1.5, "pull", STABLE, 0.45, "accuracy 0.1"),
    ("c-shape", 0.8, "contact", AUTO, 0.3, "accuracy 0.2"), ("sheet", 0.75, "force", AUTO, 0.3, "accuracy reaction=5%"),
    ("liver", 1.5, "gravity", AUTO, 0.45, "budget 2"), ("beam", 1.25, "pull", COROTATIONAL, 0.3, "budget 1"),
]


def run(*words, ends=(0,)):
    """Seconds and peak of resident memory [MB] of what ends with one of these exit codes."""
    begin = time.monotonic()
    process = subprocess.Popen([str(w) for w in words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    told = process.stderr.read()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in ends:
        raise RuntimeError(told.strip().splitlines()[-1] if told.strip() else str(process.returncode))
    return time.monotonic() - begin, used.ru_maxrss / 1024


def measure(folder, case):
    name, spacing, load, law, ratio, level = case
    body = next(b for b in scenes.BODIES if b.name == name)
    if spacing:
        body = dataclasses.replace(body, phantom=body.phantom[:-1] + [str(spacing)])
    volume, lattice, file, report = (folder / f"body{end}" for end in (".nrrd", ".hexmesh", ".toml", ".json"))
    tables = next(t for l, t in scenes.loads(body) if l == load)
    file.write_text(f"[solve]\n{law}\n{tables}")
    if body.phantom:
        run("hexscan", "-q", "phantom", *body.phantom, "-o", volume, "--force")
    else:
        body.write(volume)
    run("hexmesh", "-q", "build", volume, *(w for m in scenes.materials(body, ratio) for w in ("--material", m)), "-o", lattice, "--force")
    asked = ["hexsolve", "-q", lattice, file, *(f"--{level}".split() if isinstance(level, str) else ["--level", level])]
    planning, _ = run(*asked, "--plan", "--report", report, "--force")
    plan = json.loads(report.read_text())
    seconds, memory = run(*asked, "-o", folder / "body.hexresult", "--force", ends=(0, 5) if "accuracy" in str(level) else (0,))  # 5: it is not reached
    size = plan["levels"][-1]
    return {"cells": size["cells"], "dofs": size["dofs"], "expected_s": plan["seconds"], "s": seconds, "expected_mb": plan["memory_mb"], "mb": memory,
            "planning_s": planning}


def main():
    folder, word = pathlib.Path(sys.argv[1]), sys.argv[2]
    for case in CASES:
        name, _, load, law, ratio, level = case
        what = ", ".join(law.split('"')[1::2]) or "auto"
        told = {"name": f"{name}, {load}", "what": what, "poisson": ratio, "level": level}
        if word not in told["name"]:
            continue
        try:
            told.update(measure(folder, case))
        except RuntimeError as e:
            told["failed"] = str(e)
        print(json.dumps(told), flush=True)
        print(told["name"], told.get("failed", ""), file=sys.stderr)


main()
