# SPDX-License-Identifier: Apache-2.0
"""What Python builds and solves is what the tools build and solve, to the last bit and byte."""
import gzip
import json
import os
import re
import subprocess
import tempfile
import unittest
import warnings
from pathlib import Path

import hextools
import numpy as np

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"


def tool(*words, expect=0):
    """Runs a tool; what it says on standard error."""
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != expect:
        raise AssertionError(f"{' '.join(map(str, words))} ended with {done.returncode}: {done.stderr}")
    return done.stderr


def read_nrrd(path):
    """A Volume from a file of hexscan's, read by nothing of ours."""
    head, data = Path(path).read_bytes().split(b"\n\n", 1)
    keys = dict(re.findall(r"^([^:#]+):=? ?(.*)$", head.decode(), re.M))
    if keys["encoding"] == "gzip":
        data = gzip.decompress(data)
    kind = {"unsigned char": "u1", "unsigned short": "<u2", "short": "<i2", "float": "<f4"}[keys["type"]]
    values = np.frombuffer(data, kind).reshape([int(n) for n in keys["sizes"].split()], order="F")
    edges = np.array([[float(x) for x in axis.split(",")] for axis in re.findall(r"\(([^)]*)\)", keys["space directions"])])
    spacing = np.linalg.norm(edges, axis=1)
    segments = {}
    for n in range(100):
        if f"Segment{n}_LabelValue" in keys:
            tags = dict(tag.split(":", 1) for tag in keys.get(f"Segment{n}_Tags", "").split("|") if ":" in tag)
            segments[int(keys[f"Segment{n}_LabelValue"])] = {
                "name": keys[f"Segment{n}_Name"],
                "color": [float(x) for x in keys[f"Segment{n}_Color"].split()],
                "terminology": tags.get("TerminologyEntry", ""),
            }
    origin = [float(x) for x in keys["space origin"].strip("()").split(",")]
    return hextools.Volume(values, spacing, origin, (edges / spacing[:, None]).T, segments)


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def assert_same_file(self, ours, theirs):
        self.assertTrue(Path(ours).read_bytes() == Path(theirs).read_bytes(), f"{ours} and {theirs} differ")

    def assert_same_lattice(self, lattice, file):
        """The lattice written here is the tool's file, but for the lines that say who made it."""
        lattice.history = hextools.read_lattice(file).history
        lattice.write("ours.hexmesh", overwrite=True)
        self.assert_same_file("ours.hexmesh", file)

    def assert_same_result(self, result, file):
        theirs = hextools.read_result(file)
        np.testing.assert_array_equal(result.displacement, theirs.displacement)
        self.assertEqual(result.report, theirs.report)
        result.history = theirs.history
        result._costs = theirs._costs
        result.write("ours.hexresult", overwrite=True)
        self.assert_same_file("ours.hexresult", file)
        theirs.write("again.hexresult", overwrite=True)
        self.assert_same_file("again.hexresult", file)


class Lattices(InAFolder):
    def compare(self, scan, words=(), **options):
        volume = read_nrrd(scan)
        tool("hexmesh", "-q", "build", scan, *words, "--force", "-o", "theirs.hexmesh")
        self.assert_same_lattice(hextools.build(volume, **options), "theirs.hexmesh")
        for values in (np.ascontiguousarray(volume.values), volume.values.astype(np.float64)[::1]):
            other = hextools.Volume(values, volume.spacing, volume.origin, volume.direction, volume.segments)
            self.assert_same_lattice(hextools.build(other, **options), "theirs.hexmesh")

    def test_a_phantom_with_every_option(self):
        tool("hexscan", "-q", "phantom", "liver", "--spacing", "5", "-o", "liver.nrrd")
        self.compare("liver.nrrd")
        self.compare("liver.nrrd", ["--levels", "3", "--offset", "1,2,3"], levels=3, offset=(1, 2, 3))
        self.compare("liver.nrrd", ["--cell-size", "12"], cell_size=12)
        self.compare("liver.nrrd", ["--material", "liver:young_kpa=4.2,poisson=0.31", "--material", "*:none"],
                     materials={"liver": {"young_kpa": 4.2, "poisson": 0.31}, "*": None})
        self.compare("liver.nrrd", ["--material", "tumour:tissue=bone"], materials={2: "bone"})

    def test_bodies_in_any_placement(self):
        for words in (["torsion-bar", "--set", "rotate_x=17"], ["c-shape", "--set", "rotate_z=41"],
                      ["sphere", "--set", "shift_y=0.7"]):
            tool("hexscan", "-q", "phantom", *words, "--spacing", "4", "--force", "-o", "body.nrrd")
            self.compare("body.nrrd", ["--material", "*:young_kpa=5,poisson=0.4"],
                         materials={"*": {"young_kpa": 5, "poisson": 0.4}})

    def test_axes_of_any_order_and_sense(self):
        tool("hexscan", "-q", "phantom", "liver", "--spacing", "8", "-o", "liver.nrrd")
        tool("hexmesh", "-q", "build", "liver.nrrd", "-o", "theirs.hexmesh")
        whole = read_nrrd("liver.nrrd")
        for order in ((2, 0, 1), (1, 0, 2)):
            for flips in ((1, 1, 1), (-1, 1, -1)):
                values = whole.values.transpose(order)[tuple(slice(None, None, f) for f in flips)]
                spacing, axes = np.array(whole.spacing)[list(order)], np.array(whole.direction)[:, order]
                last = [0 if f > 0 else n - 1 for f, n in zip(flips, values.shape)]
                origin = whole.origin + axes @ (spacing * last)
                turned = hextools.Volume(values, spacing, origin, axes * flips, whole.segments)
                self.assert_same_lattice(hextools.build(turned), "theirs.hexmesh")

    def test_materials_that_follow_the_grey_values(self):
        tool("hexscan", "-q", "phantom", "liver", "--spacing", "6", "--intensity-out", "ct.nrrd", "-o", "liver.nrrd")
        law = {"liver": {"young_kpa": {"offset": 1.0, "slope": 0.02, "min": 0.5}, "poisson": 0.45, "density_kg_m3": 1060}}
        Path("materials.toml").write_text("[material.liver]\nyoung_kpa = { offset = 1.0, slope = 0.02, min = 0.5 }\n"
                                          "poisson = 0.45\ndensity_kg_m3 = 1060\n")
        words = ["--materials", "materials.toml", "--intensity", "ct.nrrd"]
        self.compare("liver.nrrd", words, materials=law, intensity=read_nrrd("ct.nrrd"))
        self.compare("liver.nrrd", words, materials="materials.toml", intensity=read_nrrd("ct.nrrd").values)

    def test_real_scans(self):
        found = sorted(SHARED.glob("**/*liver*.nii.gz"))[:2] if SHARED.is_dir() else []
        if not found:
            self.skipTest("no scans beside this folder")
        for scan in found:
            tool("hexscan", "-q", scan, "--force", "-o", "scan.nrrd")
            self.compare("scan.nrrd", ["--material", "*:young_kpa=3,poisson=0.45"],
                         materials={"*": {"young_kpa": 3, "poisson": 0.45}})


# What scenes call for beside supports, and the options of a call.
SCENES = {
    "as it is": ({}, {"level": 1}),
    "small strain": ({"solve": {"strain": "cauchy"}}, {"level": 1}),
    "averaged edges": ({"solve": {"strain": "corotational", "rotation": "edges"}, "gravity": {"m_s2": [0, 0.05, 0]}}, {"level": 2}),
    "full volumetric part": ({"solve": {"volumetric": "full"}}, {"level": 1}),
    "uniform stiffness": ({"solve": {"stiffness": "uniform"}}, {"level": 2}),
    "cells that bend, soft supports": ({"solve": {"stiffness": "incompatible", "supports": "soft"}}, {"level": 2}),
    "condensed cells": ({"solve": {"stiffness": "condensed"}}, {"level": 2}),
    "neo-Hookean": ({"solve": {"law": "neo-hookean"}}, {"level": 2}),
    "voxels": ({"solve": {"error_estimate": "off"}}, {"level": 0}),
    "softer": ({"material": {"liver": {"young_kpa": 1.5}}}, {"level": 2}),
    "accuracy": ({}, {"accuracy": 1.5}),
    "reactions": ({}, {"reaction_accuracy": 0.3}),
    "graded": ({}, {"level": 1, "coarser_by": 1}),
    "contact": ({"contact": [{"name": "ball", "sphere": {"center_mm": [0, -75, 0], "radius_mm": 30}, "by_mm": [0, 12, 0],
                              "stiffness_n_mm": 0.05}]},
                {"level": 2}),
    "scan under load": ({"solve": {"reference": "loaded"}, "loaded": {"gravity": {"m_s2": [0, 2, 0]}}}, {"level": 3}),
    "motion": ({"solve": {"kind": "dynamics"}, "dynamics": {"step_s": 0.02, "duration_s": 0.1}}, {"level": 3}),
}
WORDS = {"level": "--level", "accuracy": "--accuracy"}


def words_of(options):
    if "coarser_by" in options:
        return ["--level", f"{options['level']}:{options['level'] + options['coarser_by']}"]
    if "reaction_accuracy" in options:
        return ["--accuracy", f"reaction={options['reaction_accuracy']}"]
    return [word for name, value in options.items() for word in (WORDS[name], str(value))]


class Solutions(InAFolder):
    def setUp(self):
        super().setUp()
        tool("hexscan", "-q", "phantom", "liver", "--spacing", "6", "-o", "liver.nrrd")
        tool("hexmesh", "-q", "build", "liver.nrrd", "-o", "liver.hexmesh")
        tool("hexsolve", "liver.hexmesh", "--example", "-o", "example.toml")

    def test_scenes_of_every_kind(self):
        made = hextools.build(read_nrrd("liver.nrrd"))
        read = hextools.read_lattice("liver.hexmesh")
        made.history = read.history
        example = Path("example.toml").read_text()
        tables = re.sub(r"(?ms)^\[solve\].*?(?=^\[)", "", example)
        for name, (more, options) in SCENES.items():
            with self.subTest(name):
                from hextools._text import toml_of
                acting = re.sub(r"(?ms)^\[\[displace\]\].*?(?=^\[|\Z)", "", tables) if "gravity" in more else tables
                Path("scene.toml").write_text(toml_of(more) + acting)
                tool("hexsolve", "-q", "liver.hexmesh", "scene.toml", *words_of(options), "--force", "-o", "theirs.hexresult")
                for lattice in (made, read):
                    self.assert_same_result(hextools.solve(lattice, "scene.toml", **options), "theirs.hexresult")

    def test_what_is_missing_is_said_as_the_tool_says_it(self):
        lattice = hextools.read_lattice("liver.hexmesh")
        pull = "[[displace]]\nname = 'a'\npoint_mm = [0, 0, 0]\nradius_mm = {}\nby_mm = [0, 0, 1]\n"
        for text, code in (("[[fix]]\nname = 'a'\npoint_mm = [900, 0, 0]\n", 4), (pull.format("'big'"), 3), ("", 4),
                           ("[solve]\nstrian = 'cauchy'\n", 3), ("[solve]\nlevel = 99\n", 3), ("[[fix]\n", 3)):
            Path("scene.toml").write_text(text)
            said = tool("hexsolve", "-q", "liver.hexmesh", "scene.toml", "-o", "no.hexresult", expect=code)
            with self.assertRaises(hextools.Error) as caught:
                hextools.solve(lattice, "scene.toml")
            self.assertEqual(f"hexsolve: error: {caught.exception}\n", said)
            self.assertEqual(caught.exception.exit_code, code)

    def test_what_does_not_converge_comes_with_the_last_state_that_did(self):
        Path("scene.toml").write_text("[solve]\nlaw = 'neo-hookean'\nlevel = 3\nerror_estimate = 'off'\n[gravity]\nm_s2 = [0, 4000, 0]\n" +
                                      re.sub(r"(?ms)^\[solve\].*?(?=^\[)", "", Path("example.toml").read_text()))
        said = tool("hexsolve", "-q", "liver.hexmesh", "scene.toml", "-o", "theirs.hexresult", expect=5)
        with self.assertRaises(hextools.NotConverged) as caught:
            hextools.solve("liver.hexmesh", "scene.toml")
        self.assertIn(str(caught.exception), said)
        self.assert_same_result(caught.exception.result, "theirs.hexresult")

    def test_checks_and_plans(self):
        tool("hexsolve", "-q", "liver.hexmesh", "example.toml", "--check", "--report", "check.json")
        self.assertEqual(hextools.check("liver.hexmesh", "example.toml"), json.loads(Path("check.json").read_text()))
        tool("hexsolve", "-q", "liver.hexmesh", "example.toml", "--plan", "--level", "1", "--report", "plan.json")
        theirs, ours = json.loads(Path("plan.json").read_text()), hextools.plan("liver.hexmesh", "example.toml", level=1)
        self.assertEqual([level["dofs"] for level in ours["levels"]], [level["dofs"] for level in theirs["levels"]])
        self.assertEqual(hextools.example_scene("liver.hexmesh"), Path("example.toml").read_text())

    def test_the_deformed_scan_is_the_tools(self):
        tool("hexscan", "-q", "phantom", "liver", "--spacing", "6", "--intensity-out", "ct.nrrd", "--force", "-o", "liver.nrrd")
        tool("hexsolve", "-q", "liver.hexmesh", "example.toml", "--level", "2", "-o", "theirs.hexresult")
        tool("hexexport", "-q", "theirs.hexresult", "--scan", "ct.nrrd", "--to", "moved.nrrd")
        moved = hextools.read_result("theirs.hexresult").deform(read_nrrd("ct.nrrd"))
        theirs = read_nrrd("moved.nrrd")
        np.testing.assert_array_equal(np.round(moved.values).astype(theirs.values.dtype), np.round(theirs.values))
        np.testing.assert_allclose(moved.origin, theirs.origin, atol=1e-9)


warnings.simplefilter("ignore", hextools.Warning)

if __name__ == "__main__":
    unittest.main()
