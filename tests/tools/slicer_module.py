# SPDX-License-Identifier: Apache-2.0
"""The command-line module of 3D Slicer: its description keeps to the schema of such modules, and it does the whole job.

usage: slicer_module.py MODULE BIN
"""
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

MODULE, BIN = sys.argv[1:]
ENVIRONMENT = {**os.environ, "HEXTOOLS_BIN": BIN, "PATH": f"{BIN}:{os.environ['PATH']}", "LD_LIBRARY_PATH": "/nowhere"}

# Of the schema (ctkCmdLineModule.xsd of CTK, ModuleDescription.xsd of Slicer): the head, the kinds, and the order within a parameter.
HEAD = ["category", "title", "description", "version", "documentation-url", "license", "contributor"]
KINDS = {"integer", "double", "double-vector", "point", "region", "file", "image", "geometry", "transform"}
ORDER = ["name", "longflag", "description", "label", "default", "channel", "constraints"]
ATTRIBUTES = {"point": {"multiple"}, "region": {"multiple"}, "file": {"fileExtensions"}, "image": {"type"},
              "geometry": {"type", "fileExtensions"}, "transform": {"type", "fileExtensions"}}


def expect(holds, what):
    if not holds:
        sys.exit(f"FAILED: {what}")


def module(*words, code=0):
    done = subprocess.run([MODULE, *map(str, words)], env=ENVIRONMENT, capture_output=True, text=True, check=False)
    expect(done.returncode == code, f"{words} ended with {done.returncode}: {done.stderr}")
    return done.stdout if code == 0 else done.stderr


def tool(*words):
    subprocess.run(words, env=ENVIRONMENT, check=True)


def check_description():
    root = xml.fromstring(module("--xml"))
    expect(root.tag == "executable", "the root is executable")
    expect([e.tag for e in root][: len(HEAD)] == HEAD, "the head is in order")
    names = []
    for group in list(root)[len(HEAD):]:
        expect(group.tag == "parameters" and [e.tag for e in group][:2] == ["label", "description"], "groups have label and description")
        for parameter in list(group)[2:]:
            tags = [e.tag for e in parameter]
            expect(parameter.tag in KINDS, f"{parameter.tag} is a kind of parameter")
            expect(tags == [tag for tag in ORDER if tag in tags] and tags[:4] == ORDER[:4], f"{tags} are in order")
            expect(set(parameter.attrib) <= ATTRIBUTES.get(parameter.tag, set()), f"{parameter.attrib} of {parameter.tag}")
            name = parameter.findtext("name")
            expect(parameter.findtext("longflag") == f"--{name}", f"the flag of {name}")
            expect(parameter.findtext("channel") in (None, "input", "output"), f"the channel of {name}")
            names.append(name)
    expect(len(set(names)) == len(names), "names are unique")
    source = Path(MODULE).read_text()
    for name in names:
        expect(f"--{name}" in source, f"--{name} is read")


def check_job():
    tool("hexscan", "-q", "phantom", "liver", "--spacing", "6", "--intensity-out", "ct.nrrd", "-o", "labels.nrrd")
    held, pulled, to = (-98.0, -6.0, -8.0), (99.0, -14.0, 4.0), (92.0, -20.0, -6.0)  # LPS
    ras = lambda p: f"{-p[0]},{-p[1]},{p[2]}"
    outputs = {"deformed": "moved.nrrd", "deformedLabels": "labels_moved.nrrd", "transform": "moved.h5", "model": "moved.vtp"}
    words = [word for name, file in outputs.items() for word in (f"--{name}", file)]
    said = module("--labels", "labels.nrrd", "--scan", "ct.nrrd", "--hold", ras(held), "--holdRegion", "55,-48,-16,15,15,15", "--pull", ras(pulled),
                  "--to", ras(to), "--radius", "15", "--level", "2", "--gravity", "0,-1,0", *words)
    expect("<filter-progress>" in said, "it tells its progress")
    Path("scene.toml").write_text(f"""
[[fix]]
name = "held 1"
point_mm = {list(held)}
radius_mm = 15
[[fix]]
name = "held region 1"
box_mm = [-70, -40, 33, 63, -31, -1]
[[displace]]
name = "pulled 1"
point_mm = {list(pulled)}
radius_mm = 15
by_mm = {[b - a for a, b in zip(pulled, to)]}
[gravity]
m_s2 = [0, 1, 0]
""")
    tool("hexmesh", "-q", "build", "labels.nrrd", "--material", "*:young_kpa=3,poisson=0.45,density_kg_m3=1050", "-o", "body.hexmesh")
    tool("hexsolve", "-q", "body.hexmesh", "scene.toml", "--level", "2", "-o", "body.hexresult")
    tool("hexexport", "-q", "body.hexresult", "--scan", "ct.nrrd", "--to", "theirs.nrrd", "--segmentation", "labels_theirs.nrrd",
         "--transform", "theirs.h5")
    tool("hexexport", "-q", "body.hexresult", "--deformed", "--surface", "theirs.vtp")
    for ours, theirs in (("moved.nrrd", "theirs.nrrd"), ("labels_moved.nrrd", "labels_theirs.nrrd"), ("moved.vtp", "theirs.vtp")):
        expect(Path(ours).read_bytes() == Path(theirs).read_bytes(), f"{ours} is what the tools make")
    expect(Path("moved.h5").stat().st_size == Path("theirs.h5").stat().st_size, "the transform too")


def check_refusals():
    for words, code, says in ((["--labels", "labels.nrrd", "--pull", "1,2,3"], 2, "1 pulled points and 0"),
                              (["--labels", "labels.nrrd", "--hold", "1,2"], 2, "expected 3 numbers"),
                              (["--labels", "labels.nrrd", "--hold", "1,2,$(touch gone)"], 2, "expected 3 numbers"),
                              (["--labels", "labels.nrrd", "--young", "x"], 2, "expected 1 numbers"),
                              (["--labels", "labels.nrrd", "--deformed", "a.nrrd"], 2, "without --scan"),
                              ([], 2, "no --labels"), (["--what"], 2, "unknown argument"),
                              (["--labels", "nothing.nrrd"], 3, "nothing.nrrd"),
                              (["--labels", "labels.nrrd", "--model", "a.vtp"], 4, "held"),
                              (["--labels", "labels.nrrd", "--hold", "900,0,0"], 4, "held 1")):
        said = module(*words, code=code)
        expect(says in said, f"{words} says '{says}': {said}")
        expect(not Path("gone").exists() and not Path("a.vtp").exists(), "nothing is written")


MODULE = str(Path(MODULE).resolve())
BIN = str(Path(BIN).resolve())
check_description()
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    check_job()
    check_refusals()
print("all as expected")
