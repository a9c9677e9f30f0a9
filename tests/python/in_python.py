# SPDX-License-Identifier: Apache-2.0
"""The package as part of Python: refusals, threads, signals, memory, bridges, stubs."""
import ast
import copy
import gc
import hashlib
import inspect
import json
import os
import pickle
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings
from importlib.util import find_spec
from pathlib import Path

import hextools
import numpy as np

warnings.simplefilter("ignore", hextools.Warning)

MATERIAL = {"*": {"young_kpa": 3, "poisson": 0.45, "density_kg_m3": 1000}}
BAR = np.ones((4, 4, 12), dtype=np.uint16)
HELD = {"fix": [{"name": "end", "halfspace": {"point_mm": [0, 0, 0], "normal": [0, 0, -1]}}], "gravity": {"m_s2": [0, 1, 0]}}
FALLS = {**HELD, "solve": {"kind": "dynamics"}, "dynamics": {"step_s": 0.01, "duration_s": 0.05}}
EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "python"


def bar(edge=2.0, shape=BAR.shape):
    return hextools.build(np.ones(shape, dtype=np.uint16), spacing=(edge, edge, edge), materials=MATERIAL)


class Arrays(unittest.TestCase):
    def test_what_is_wrong_is_said(self):
        spaced = {"spacing": (1, 1, 1), "materials": MATERIAL}
        for labels, options, says in (
            (np.ones((3, 3)), spaced, "labels has shape (3, 3), expected three axes (i, j, k)"),
            (np.zeros((0, 3, 3)), spaced, "labels has shape (0, 3, 3), expected voxels"),
            (np.zeros((3, 3, 3), int), spaced, "no labelled voxel"),
            (np.full((3, 3, 3), np.nan), spaced, "values from nan to nan, expected 0 to 65535"),
            (np.full((3, 3, 3), -1), spaced, "values from -1 to -1, expected 0 to 65535"),
            (np.full((3, 3, 3), 70000), spaced, "values from 70000 to 70000, expected 0 to 65535"),
            (np.full((3, 3, 3), 0.5), spaced, "no whole numbers"),
            (np.full((3, 3, 3), 1j), spaced, "values of type complex128, expected numbers"),
            ("liver.nrrd", spaced, "values of type <U10, expected numbers"),
            (BAR, {**spaced, "spacing": (1, 1)}, "spacing has shape (2,), expected three numbers"),
            (BAR, {**spaced, "spacing": (1, 0, 1)}, "spacing"),
            (BAR, {**spaced, "spacing": (1, np.inf, 1)}, "the spacing is [1.0, inf, 1.0], expected finite numbers"),
            (BAR, {**spaced, "direction": np.ones((3, 3))}, "direction"),
            (BAR, {**spaced, "direction": np.eye(2)}, "direction has shape (2, 2), expected (3, 3)"),
            (BAR, {"materials": {"liver": {"young_kpa": 3, "poisson": 0.5}}}, "unknown segment 'liver'"),
            (BAR, {"materials": {1: {"young_kpa": 3, "poisson": 0.6}}}, "poisson is 0.6"),
            (BAR, {"materials": {1: {"young": 3}}}, "unknown key 'material.label_1.young'"),
            (BAR, {"materials": {1: 3}}, "expected a mapping, the name of a tissue, or None"),
            (BAR, {"materials": {1: "cheese"}}, "unknown tissue 'cheese'"),
            (BAR, {}, "label_1"),
            (BAR, {"segments": {0: "none"}}, "a label of segments is 0, expected a whole number from 1 to 65535"),
            (BAR, {"segments": {1: "liver"}, "intensity": np.ones((2, 2, 2))}, "intensity has shape (2, 2, 2)"),
            (BAR, {"segments": {1: "liver"}, "intensity": np.ones(BAR.shape)}, "no material follows the grey values"),
            (BAR, {**spaced, "levels": 99}, "levels is 99, expected a whole number from 0 to 20"),
            (BAR, {**spaced, "levels": 1.5}, "levels is 1.5, expected a whole number"),
            (BAR, {**spaced, "offset": (0, -1, 0)}, "offset is -1"),
            (BAR, {**spaced, "cell_size": -1}, "cell_size is -1"),
            (hextools.Volume(BAR), spaced, "spacing and a Volume"),
            (np.ma.masked_array(BAR, BAR == 1), spaced, "labels is a masked array"),
            (BAR, {"segments": {1: "\ud800"}}, "is not Unicode"),
            (BAR, {"materials": "[material.label_1]\nyoung_kpa = 3\n"}, "expected young_kpa and poisson, a tissue or none"),
        ):
            with self.subTest(says), self.assertRaises(hextools.Error) as caught:
                hextools.build(labels, **options)
            self.assertIn(says, str(caught.exception))
            self.assertNotIn("\n", str(caught.exception))
            self.assertNotIn("--", str(caught.exception))

    def test_scenes_name_the_key_that_is_wrong(self):
        lattice = bar()
        for scene, says in (
            ({"solve": {"level": 99}}, "scene: solve.level is 99"),
            ({"solve": {"strian": "cauchy"}}, "scene: unknown key 'solve.strian'"),
            ({"fix": {"point_mm": [0, 0, 0]}}, "scene: fix is"),
            ({"fix": [{"name": "a", "point_mm": [0, 0]}]}, "scene: fix.point_mm is"),
            ({"fix": [{"name": "a", "point_mm": [0, 0, np.nan]}]}, "fix.point_mm is nan"),
            ({"fix": [{"name": "a", "point_mm": [999, 0, 0]}]}, "condition 'a' (scene)"),
            ({"fix": [{"name": "a", "point_mm": object()}]}, "fix.point_mm is of type object"),
            ({1: 2}, "has the key 1, expected texts"),
            ({"gravity": {"m_s2": [0, 0, "\ud800"]}}, "is not Unicode"),
            ("[solve]\nlevel = 99\n", "scene:2:9: solve.level is 99"),
            ({"fix": {}}, "scene: fix is"),
            (3, "the scene is of type int, expected a mapping, TOML, or a file"),
            ("nothing.toml", "nothing.toml"),
        ):
            with self.subTest(says), self.assertRaises(hextools.Error) as caught:
                hextools.solve(lattice, scene)
            self.assertIn(says, str(caught.exception))
        for options, says in (({"level": 99}, "level is 99"), ({"level": 7}, "level is 7, expected 0 to"), ({"accuracy": -1}, "accuracy is -1"),
                              ({"level": 0, "budget": 1}, "expected one"), ({"budget": np.nan}, "budget is nan"),
                              ({"progress": 3}, "expected a function")):
            with self.subTest(says), self.assertRaises(hextools.Error) as caught:
                hextools.solve(lattice, HELD, **options)
            self.assertIn(says, str(caught.exception))

    def test_views_are_read_only_and_outlive_their_owner(self):
        result = hextools.solve(bar(), HELD, level=0)
        moved, labels, field = result.displacement, result.labels, result.stress
        with self.assertRaises(ValueError):
            moved[0, 0] = 1
        copies = moved.copy(), labels.copy(), field.copy()
        del result
        gc.collect()
        junk = [np.ones(1000) for _ in range(1000)]
        for view, copy in zip((moved, labels, field), copies):
            np.testing.assert_array_equal(view, copy)
        del junk

    def test_points_move_with_their_cells(self):
        lattice = bar()
        result = hextools.solve(lattice, HELD, level=0)
        np.testing.assert_allclose(result.displacement_at(result.nodes), result.displacement, atol=1e-12)
        middles = result.nodes[result.cell_nodes].mean(axis=1)
        expected = result.displacement[result.cell_nodes].mean(axis=1)
        np.testing.assert_allclose(result.displacement_at(middles), expected, atol=1e-12)
        self.assertTrue(np.isnan(result.displacement_at([[500, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0]])).all())
        self.assertEqual(result.displacement_at(np.empty((0, 3))).shape, (0, 3))
        for points in ([1, 2, 3], np.ones((2, 2)), "point"):
            with self.assertRaises(hextools.UsageError):
                result.displacement_at(points)

    def test_matrices_of_a_parent_are_those_of_its_children(self):
        lattice = hextools.build(np.pad(BAR, 1), spacing=(2, 3, 4), materials=MATERIAL)
        linear = np.array([[0.1, 0.2, -0.3], [0.4, -0.1, 0.2], [0.05, 0.3, 0.2]])
        energies = []
        for number, level in enumerate(lattice.levels):
            stiffness = lattice.stiffness(number)
            np.testing.assert_array_equal(stiffness, stiffness.transpose(0, 2, 1))
            u = (level.nodes @ linear.T)[level.cell_nodes].reshape(len(level), 24)
            energies.append(np.einsum("ci,cij,cj", u, stiffness[level.element], u))
            mass = lattice.mass(number)[level.element].sum()
            self.assertAlmostEqual(mass / (BAR.size * 24e-12 * 1000 / 1000), 1000 / 1000, delta=1e3)
        np.testing.assert_allclose(energies, energies[0], rtol=1e-12)

    def test_a_motion_step_by_step_is_the_whole(self):
        lattice = bar()
        whole = hextools.solve(lattice, FALLS, level=0)
        states = list(hextools.motion(lattice, FALLS, level=0))
        np.testing.assert_allclose([state["time"] for state in states], whole.times)
        for number, state in enumerate(states):
            np.testing.assert_array_equal(state["displacement"], whole.step(number)["displacement"])
        np.testing.assert_array_equal(whole.step(-1)["displacement"], whole.displacement)
        for number in (6, -7):
            with self.assertRaises(IndexError):
                whole.step(number)
        with self.assertRaises(hextools.InputError):
            hextools.motion(lattice, HELD)

    def test_a_motion_ends_where_its_duration_does(self):
        motion = hextools.motion(bar(), FALLS, level=1)
        self.assertEqual(repr(motion), "<hextools.Motion after 0 of 5 steps>")
        for state in motion:
            if state["time"] > 0.015:
                break
        np.testing.assert_allclose([s["time"] for s in motion], [0.03, 0.04, 0.05])
        self.assertIsNone(motion.step())
        self.assertEqual(list(motion), [])
        shared, times = hextools.motion(bar(), FALLS, level=1), []

        def work():
            while (state := shared.step()) is not None:
                times.append(round(state["time"], 6))

        threads = [threading.Thread(target=work) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(sorted(times), [0.01, 0.02, 0.03, 0.04, 0.05])

    def test_objects_are_copied_and_pickled_and_made_by_nothing_else(self):
        lattice = bar()
        for result in (hextools.solve(lattice, HELD, level=1), hextools.solve(lattice, FALLS, level=1)):
            for copied in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
                np.testing.assert_array_equal(copied.displacement, result.displacement)
                np.testing.assert_array_equal(copied.labels, result.labels)
                np.testing.assert_array_equal(copied.times, result.times)
                self.assertEqual((copied.report, copied.history), (result.report, result.history))
                if len(result.times):
                    np.testing.assert_array_equal(copied.step(2)["velocity"], result.step(2)["velocity"])
        copied = pickle.loads(pickle.dumps(lattice))
        np.testing.assert_array_equal(hextools.solve(copied, HELD, level=0).displacement, hextools.solve(lattice, HELD, level=0).displacement)
        for kind in (hextools.Lattice, hextools.Level, hextools.Result):
            for make in (kind, lambda kind=kind: kind.__new__(kind), type("Sub", (kind,), {})):
                with self.assertRaises(TypeError):
                    make()

    def test_histories_say_what_was_read(self):
        with tempfile.TemporaryDirectory() as folder:
            path, scene = Path(folder) / "bar.hexmesh", Path(folder) / "held.toml"
            bar().write(path)
            scene.write_text("[gravity]\nm_s2 = [0, 1, 0]\n[[fix]]\nname = 'a'\nhalfspace = { point_mm = [0, 0, 0], normal = [0, 0, -1] }\n")
            said = hextools.solve(path, scene, level=1).history[-1].split("\n")
            self.assertEqual(said[0], "hextools.solve(level=1) of Python")
            self.assertTrue(said[1].endswith(f"  {path}") and len(said[1].split()[0]) == 64)
            self.assertEqual(said[2], f"{hashlib.sha256(scene.read_bytes()).hexdigest()}  {scene}")

    def test_warnings_that_are_errors_lose_nothing(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(hextools.Warning) as caught:
                hextools.solve(bar(), {**HELD, "loaded": {"gravity": {"m_s2": [0, 1, 0]}}}, level=1)
        self.assertGreater(np.abs(caught.exception.result.displacement).max(), 0)

    def test_the_default_stiffness_of_a_solution(self):
        lattice = hextools.build(np.pad(BAR, 1), spacing=(2, 2, 2), materials=MATERIAL)
        for volumetric in ("mean", "full"):
            low = {"fix": [{"name": "end", "halfspace": {"point_mm": [0, 0, 1.5], "normal": [0, 0, -1]}}]}
            scene = {**HELD, **low, "solve": {"strain": "cauchy", "volumetric": volumetric, "tolerance": 1e-10}}
            result = hextools.solve(lattice, scene, level=1)
            u = result.displacement[result.cell_nodes].reshape(len(result.cells), 24)
            stiffness = lattice.stiffness(1, volumetric)[lattice.levels[1].element]
            energy = np.einsum("ci,cij,cj", u, stiffness, u) / 2
            self.assertAlmostEqual(energy / result.report["strain_energy_n_mm"], 1, delta=1e-9)
        with self.assertRaises(hextools.UsageError):
            lattice.stiffness(1, "none")

    def test_files_are_not_lost(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "bar.hexmesh"
            bar().write(path)
            before = path.read_bytes()
            with self.assertRaises(hextools.OutputError) as caught:
                bar(3.0).write(path)
            self.assertIn("exists", str(caught.exception))
            self.assertEqual(path.read_bytes(), before)
            bar(3.0).write(path, overwrite=True)
            self.assertNotEqual(path.read_bytes(), before)
            for wrong in (path.with_name("nothing.hexmesh"), Path(folder), Path(__file__)):
                with self.assertRaises(hextools.InputError):
                    hextools.read_lattice(wrong)
                with self.assertRaises(hextools.InputError):
                    hextools.read_result(wrong)
            with self.assertRaises(hextools.OutputError):
                bar().write(Path(folder) / "no" / "folder.hexmesh")
            self.assertEqual(sorted(os.listdir(folder)), ["bar.hexmesh"])


class Junk(unittest.TestCase):
    """Ten thousand calls with what nobody means: each returns or raises, and the last still works."""

    CALLS = 10_000

    def junk(self, depth=0):
        r = self.random
        kinds = [
            lambda: r.choice([None, True, False, -1, 0, 1, 2, 3, 99, 2**31, 2**63, -(2**70), 10**400]),
            lambda: r.choice([0.0, -0.0, 0.5, 1e-300, 1e300, float("nan"), float("inf"), -float("inf"), 1j]),
            lambda: r.choice(["", "a", "liver", "label_1", "*", "\0", "\ud800", "[solve]\n", "x = 1", "nothing.toml", "/", "é" * 9]),
            lambda: r.choice([b"", b"abc", object(), int, len, Ellipsis, slice(1), range(3), Path("/dev/null")]),
            lambda: r.choice([np.eye(3), np.ones(3), np.zeros((2, 2, 2)), np.ones((3, 3, 3), np.uint8), BAR, BAR[::-1, ::2], BAR.T,
                              np.empty((0, 3)), np.ones((2, 3)), np.array("x"), np.array([object()]), np.float32(2), np.int8(-3),
                              np.ones((2, 3, 4), ">u2"), np.ones((3, 3, 3), "f2"), np.array(3), np.ma.masked_array([1, 2, 3], [0, 1, 0]),
                              np.broadcast_to(np.uint16(1), (3, 4, 5)), np.ones((1, 1, 1)), np.datetime64("2020-01-01")]),
        ]
        if depth < 4:
            kinds += [
                lambda: [self.junk(depth + 1) for _ in range(r.randrange(5))],
                lambda: tuple(self.junk(depth + 1) for _ in range(3)),
                lambda: {self.key(): self.junk(depth + 1) for _ in range(r.randrange(4))},
                lambda: hextools.Volume(*(self.junk(depth + 1) for _ in range(r.randrange(1, 6)))),
                lambda: {1: {"young_kpa": self.junk(depth + 1), "poisson": 0.3}},
                lambda: {**HELD, self.key(): self.junk(depth + 1)},
                lambda: {"fix": [{"name": "a", self.key(): self.junk(depth + 1)}]},
            ]
        return r.choice(kinds)()

    def key(self):
        return self.random.choice(["solve", "fix", "displace", "force", "gravity", "contact", "dynamics", "material", "loaded", "name", "level",
                                   "point_mm", "radius_mm", "by_mm", "m_s2", "halfspace", "box_mm", "segment", "on", "strain", "law", "kind",
                                   "accuracy_mm", "grading", "reference", "tolerance", "", "a.b", "\n", 1, None, "poisson", "young_kpa"])

    def test_never_crashes(self):
        self.random = random.Random(20100)
        lattice, r = bar(), self.random
        results = [hextools.solve(lattice, HELD, level=1), hextools.solve(lattice, FALLS, level=1)]
        before = results[0].displacement.copy()
        options = {
            hextools.build: ["spacing", "origin", "direction", "segments", "materials", "intensity", "levels", "offset", "cell_size"],
            hextools.solve: ["level", "coarser_by", "accuracy", "reaction_accuracy", "budget", "progress", "folder"],
            hextools.check: ["level", "folder"], hextools.plan: ["level", "accuracy", "budget"], hextools.motion: ["level", "folder"],
        }
        counts = {"returned": 0, "raised": 0}
        allowed = (hextools.Error, TypeError, ValueError, IndexError, OverflowError, MemoryError, AttributeError, FileNotFoundError)
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(self.CALLS):
                function = r.choice([*options, *("method",) * 3])
                said = {name: self.junk() for name in r.sample(options.get(function, [None]), r.randrange(3) if function != "method" else 0)
                        if name} if function != "method" else {}
                try:
                    if function is hextools.build:
                        labels = BAR if r.random() < 0.6 else self.junk()
                        said.setdefault("materials", MATERIAL)
                        function(labels, **said)
                    elif function == "method":
                        owner = r.choice([lattice, lattice.levels[0], *results])
                        name = r.choice([n for n in dir(owner) if not n.startswith("_")])
                        found = getattr(owner, name)
                        if callable(found) and name == "write":
                            found(os.path.join(folder, "x"), overwrite=True, **({"matrices": self.junk()} if owner is lattice else {}))
                        elif callable(found):
                            found(*(self.junk() for _ in range(r.randrange(3))))
                    else:
                        of = lattice if r.random() < 0.8 else self.junk()
                        scene = r.choice([HELD, FALLS]) if r.random() < 0.4 else self.junk()
                        if "budget" in said:
                            said["budget"] = 0.01 if r.random() < 0.5 else said["budget"]
                        function(of, scene, **said)
                    counts["returned"] += 1
                except allowed:
                    counts["raised"] += 1
        self.assertGreater(counts["returned"], self.CALLS / 20)
        self.assertGreater(counts["raised"], self.CALLS / 20)
        np.testing.assert_array_equal(hextools.solve(lattice, HELD, level=1).displacement, before)


class Running(unittest.TestCase):
    def test_a_thousand_solutions_leave_nothing(self):
        lattice = bar()

        def resident():
            gc.collect()
            return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

        def rounds(count):
            for _ in range(count):
                result = hextools.solve(lattice, HELD, level=1, progress=lambda told: None)
                result.displacement_at(result.nodes)
                _ = result.report, result.surface, result.fields

        rounds(200)
        before = resident()
        rounds(1000)
        self.assertLess(resident() - before, 8_000_000)  # a result has some 100 KB; heaps of threads vary

    def test_two_threads_solve_at_once(self):
        bodies = [bar(2.0, (6, 6, 24)), bar(3.0, (8, 5, 20))]
        expected = [hextools.solve(body, HELD, level=0).displacement for body in bodies]
        found, errors = {}, []

        def work(number):
            try:
                with tempfile.TemporaryDirectory() as folder:
                    for turn in range(6):
                        result = hextools.solve(bodies[number % 2], HELD, level=0)
                        path = Path(folder) / f"{turn}.hexresult"
                        result.write(path)
                        found[number, turn] = hextools.read_result(path).displacement
            except Exception as error:
                errors.append(error)

        threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(errors, [])
        self.assertEqual(len(found), 24)
        for (number, _), displacement in found.items():
            np.testing.assert_array_equal(displacement, expected[number % 2])

    def test_the_interpreter_is_free_meanwhile(self):
        body = bar(2.0, (24, 24, 60))
        looked = []

        def solve():
            hextools.solve(body, HELD, level=0)
            looked.append("end")

        worker = threading.Thread(target=solve)
        worker.start()
        while worker.is_alive():
            looked.append("look")
            time.sleep(0.001)
        worker.join()
        self.assertGreater(looked.index("end"), 3)

    def test_progress_tells_and_may_end_it(self):
        body, told = bar(2.0, (6, 6, 24)), []
        hextools.solve(body, HELD, level=0, progress=told.append)
        self.assertGreater(len(told), 2)
        self.assertEqual(told[-1]["level"], 0)
        self.assertTrue(all(t["part"] is None or 0 <= t["part"] <= 1 for t in told))
        hextools.solve(body, FALLS, level=1, progress=lambda t: told.append(t["time"]))
        self.assertAlmostEqual(told[-1], 0.05)

        class Enough(Exception):
            pass

        def ends(_):
            raise Enough

        for scene in (HELD, FALLS):
            with self.assertRaises(Enough):
                hextools.solve(body, scene, level=0, progress=ends)

    def test_ctrl_c(self):
        script = """
import hextools, numpy as np, sys
body = hextools.build(np.ones((40, 40, 80), dtype=np.uint8), spacing=(1, 1, 1), materials={1: {"young_kpa": 3, "poisson": 0.49, "density_kg_m3": 1000}})
scene = {"solve": {"law": "neo-hookean", "error_estimate": "off"}, "fix": [{"name": "end", "halfspace": {"point_mm": [0, 0, 0], "normal": [0, 0, -1]}}], "gravity": {"m_s2": [0, 3, 0]}}
try:
    hextools.solve(body, scene, level=0, progress=lambda told: (sys.stdout.write("step\\n"), sys.stdout.flush()))
    print("solved", flush=True)
except KeyboardInterrupt:
    small = hextools.build(np.ones((4, 4, 8), dtype=np.uint8), materials={1: {"young_kpa": 3, "poisson": 0.4}})
    print("interrupted", len(hextools.solve(small, scene, level=0).nodes), flush=True)
"""
        run = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
        self.assertEqual(run.stdout.readline(), "step\n")  # of the coarsest level, which leaves nearly all to do
        run.send_signal(signal.SIGINT)
        self.assertEqual(run.communicate()[0].split("\n")[-2], "interrupted 225")

    def test_threads_and_memory(self):
        expected = hextools.solve(bar(), HELD, level=0).displacement
        for count in (1, 3, 0):
            hextools.set_threads(count)
            np.testing.assert_array_equal(hextools.solve(bar(), HELD, level=0).displacement, expected)
        body = bar(1.0, (20, 20, 40))
        hextools.set_max_memory(1)
        try:
            with self.assertRaisesRegex(hextools.InputError, "set_max_memory"):
                hextools.solve(body, HELD, level=0)
        finally:
            hextools.set_max_memory(8000)


class Bridges(unittest.TestCase):
    VOLUME = hextools.Volume(np.arange(24, dtype=np.int16).reshape(2, 3, 4), (1, 2, 3), (10, -20, 30),
                             [[0, 0, -1], [1, 0, 0], [0, -1, 0]])

    def assert_same(self, volume):
        np.testing.assert_array_equal(volume.values, self.VOLUME.values)
        for name in ("spacing", "origin", "direction"):
            np.testing.assert_allclose(np.asarray(getattr(volume, name)), np.asarray(getattr(self.VOLUME, name)), atol=1e-6)

    @unittest.skipUnless(find_spec("nibabel"), "no nibabel")
    def test_nibabel(self):
        image = hextools.to_nibabel(self.VOLUME)
        self.assert_same(hextools.from_nibabel(image))
        # RAS: the first voxel is at (-10, 20, 30); one step along j, of 2 mm, goes to the patient's head less.
        np.testing.assert_allclose(image.affine @ [0, 1, 0, 1], [-10, 20, 28, 1])
        import nibabel
        in_metres = nibabel.Nifti1Image(self.VOLUME.values[..., None], np.diag([1e-3, 1e-3, 1e-3, 1]) @ image.affine)
        in_metres.header.set_xyzt_units("meter")
        self.assert_same(hextools.from_nibabel(in_metres))
        for kind in (bool, np.int64, np.float16):
            volume = hextools.Volume(self.VOLUME.values.astype(kind), self.VOLUME.spacing)
            np.testing.assert_array_equal(np.asanyarray(hextools.to_nibabel(volume).dataobj), volume.values)
        warp = hextools.solve(bar(), HELD, level=1).warp()[0]
        vectors = hextools.to_nibabel(warp)
        self.assertEqual((vectors.ndim, vectors.header.get_intent()[0]), (5, "vector"))
        np.testing.assert_allclose(np.asanyarray(vectors.dataobj)[:, :, :, 0, 1], -warp.values[..., 1])
        for wrong in ("image.nii.gz", np.ones((3, 3, 3)), hextools.Volume(BAR)):
            with self.assertRaisesRegex(hextools.UsageError, "no affine"):
                hextools.from_nibabel(wrong)

    @unittest.skipUnless(find_spec("SimpleITK"), "no SimpleITK")
    def test_simple_itk(self):
        image = hextools.to_sitk(self.VOLUME)
        self.assert_same(hextools.from_sitk(image))
        np.testing.assert_allclose(image.TransformIndexToPhysicalPoint((0, 1, 0)), [10, -20, 28])
        warp = hextools.solve(bar(), HELD, level=1).warp()[0]
        self.assertEqual(hextools.to_sitk(warp).GetNumberOfComponentsPerPixel(), 3)

    @unittest.skipUnless(find_spec("pyvista"), "no pyvista")
    def test_pyvista(self):
        result = hextools.solve(bar(), HELD, level=0)
        grid = hextools.to_pyvista(result)
        self.assertAlmostEqual(grid.volume, BAR.size * 8)
        np.testing.assert_array_equal(grid.point_data["displacement"], result.displacement)
        self.assertAlmostEqual(hextools.to_pyvista(bar(), 1).volume, BAR.size * 8)

    @unittest.skipUnless(find_spec("pandas"), "no pandas")
    def test_pandas(self):
        result = hextools.solve(bar(), HELD, level=0)
        cells, nodes = hextools.to_pandas(result), hextools.to_pandas(result, "nodes")
        self.assertEqual(len(cells), BAR.size)
        np.testing.assert_array_equal(cells["von_mises_stress"], result.stress)
        np.testing.assert_array_equal(nodes["displacement_y"], result.displacement[:, 1])
        self.assertEqual(list(hextools.to_pandas(result, "conditions")["name"]), ["end"])

    def test_markups(self):
        points, names = [[1.5, -2.25, 1e-7], [99, 0.1, -3]], ["hilum", "left \u201clobe\u201d"]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "points.mrk.json"
            hextools.write_markups(path, points, names)
            read = hextools.read_markups(path)
            self.assertEqual(read["type"], "Fiducial")
            np.testing.assert_array_equal(read["points"], points)
            self.assertEqual(json.loads(path.read_text())["markups"][0]["controlPoints"][1]["label"], names[1])
            for wrong, says in ((([[np.nan, 0, 0]],), "not finite"), ((points, ["one"]), "1 names for 2 points"), (([1, 2],), "shape (2,)")):
                with self.assertRaisesRegex(hextools.UsageError, re.escape(says)):
                    hextools.write_markups(Path(folder) / "other.mrk.json", *wrong)
            with self.assertRaises(hextools.OutputError):
                hextools.write_markups(path, points)
            hextools.write_markups(path, points[:1], overwrite=True)
            self.assertEqual(len(hextools.read_markups(path)["points"]), 1)
            self.assertEqual(os.listdir(folder), ["points.mrk.json"])
            roi = hextools.read_markups(EXAMPLES.parent / "right_lobe.mrk.json")
            self.assertEqual(roi["edges"].shape, (3, 3))
            found = sorted((EXAMPLES.parents[2] / "shared" / "data").glob("**/*.mrk.json"))
            for file in found:  # of 3D Slicer itself
                slicers = hextools.read_markups(file)["points"]
                hextools.write_markups(path, slicers, overwrite=True)
                np.testing.assert_array_equal(hextools.read_markups(path)["points"], slicers)

    def test_warps_undo_each_other(self):
        result = hextools.solve(bar(), HELD, level=0)
        forward, back = result.warp()
        self.assertEqual(forward.values.shape[3], 3)
        index = np.round((result.nodes.mean(axis=0) - forward.origin) / forward.spacing).astype(int)
        place = np.asarray(forward.origin) + index * forward.spacing
        moved = forward.values[tuple(index)]
        np.testing.assert_allclose(moved, result.displacement_at([place])[0], atol=1e-4)
        self.assertEqual(back.values.shape, forward.values.shape)

    def test_what_cannot_be_shown_is_said(self):
        result = hextools.solve(bar(), {**HELD, "gravity": {"m_s2": [0, 20, 0]}}, level=0)
        scan = hextools.Volume(np.arange(12.0)[:, None, None] * np.ones((12, 12, 20)), (1, 1, 2), (-1, -1, -4))
        with self.assertWarnsRegex(hextools.Warning, "move out of the volume"):
            moved = result.deform(hextools.Volume(scan.values[:, :5], scan.spacing, scan.origin))
        self.assertEqual(moved.values.shape, (12, 5, 20))
        self.assertGreater(result.deform(scan, fitted=True).values.shape[1], 4)
        with self.assertRaisesRegex(hextools.InputError, "no part of the body"):
            result.deform(hextools.Volume(scan.values, origin=(1e5, 0, 0)))
        labels = result.deformed_labels()
        self.assertEqual(set(np.unique(labels.values)), {0, 1})
        volume = np.prod(labels.spacing) * np.count_nonzero(labels.values)
        self.assertAlmostEqual(volume / (BAR.size * 8), 1, delta=0.1)
        self.assertEqual(result.deformed_labels(scan).values.shape, (12, 12, 20))
        crushed = {"solve": {"strain": "cauchy"}, "fix": HELD["fix"],
                   "displace": [{"name": "top", "halfspace": {"point_mm": [0, 0, 22], "normal": [0, 0, 1]}, "by_mm": [0, 0, -40]}]}
        with self.assertRaisesRegex(hextools.GeometryError, "cannot hold this deformation"):
            hextools.solve(bar(), crushed, level=0).warp()


class Texts(unittest.TestCase):
    def test_everything_public_says_what_it_is(self):
        for name in hextools.__all__:
            found = getattr(hextools, name)
            self.assertTrue(inspect.getdoc(found) or inspect.ismodule(found), name)
        for kind in (hextools.Lattice, hextools.Level, hextools.Result, hextools.Motion):
            for name, member in vars(kind).items():
                if not name.startswith("_"):
                    self.assertTrue(getattr(member, "__doc__", ""), f"{kind.__name__}.{name}")

    def test_the_stub_has_what_the_module_has(self):
        core = hextools.build.__globals__["_core"]
        stub = ast.parse(Path(hextools.__file__).with_name("_core.pyi").read_text())
        classes = {node.name: {n.target.id if isinstance(n, ast.AnnAssign) else n.name for n in node.body}
                   for node in stub.body if isinstance(node, ast.ClassDef)}
        functions = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
        names = {name for name in dir(core) if not name.startswith("__")}
        self.assertEqual(names, set(classes) | functions)
        for name, members in classes.items():
            here = {m for m in vars(getattr(core, name)) if not m.startswith("__")}
            self.assertEqual(here, {m for m in members if not m.startswith("__")}, name)

    @unittest.skipUnless(find_spec("mypy"), "no mypy")
    def test_types_fit(self):
        folder = Path(hextools.__file__).parent
        with tempfile.TemporaryDirectory() as cache:
            done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", cache, "-p", "hextools"],
                                  cwd=folder.parent, env={**os.environ, "MYPYPATH": str(folder.parent)}, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_examples_run(self):
        scripts = sorted(EXAMPLES.glob("*.py"))
        self.assertGreaterEqual(len(scripts), 3)
        for script in scripts:
            with self.subTest(script.name):
                done = subprocess.run([sys.executable, "-W", "error", script], capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertTrue(done.stdout)


if __name__ == "__main__":
    unittest.main()
