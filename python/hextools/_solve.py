# SPDX-License-Identifier: Apache-2.0
"""Solutions: equilibrium and motion of a lattice under a scene."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Optional, Union

from . import _arrays, _core
from ._build import read_lattice
from ._core import Lattice, Result
from ._text import is_text, toml_of
from .errors import NotConverged, UsageError, Warning

Scene = Union[str, "os.PathLike[str]", Mapping[str, Any]]


def _scene(scene: Any, folder: Any) -> _core.Scene:
    if isinstance(scene, _core.Scene):
        return scene
    if isinstance(scene, Mapping):
        return _core.parse_scene((toml_of(scene), "scene", False), "" if folder is None else os.fspath(folder))
    if isinstance(scene, str) and is_text(scene):
        return _core.parse_scene((scene, "scene", True), "" if folder is None else os.fspath(folder))
    if isinstance(scene, (str, os.PathLike)):
        return _core.read_scene(os.fspath(scene))
    raise UsageError(f"the scene is of type {type(scene).__name__}, expected a mapping, TOML, or a file")


def _lattice(lattice: Any) -> Lattice:
    if isinstance(lattice, Lattice):
        return lattice
    if isinstance(lattice, (str, os.PathLike)):
        return read_lattice(lattice)
    raise UsageError(f"the lattice is of type {type(lattice).__name__}, expected a Lattice or a file of one")


def _asked(level: Any = None, coarser_by: Any = None, accuracy: Any = None, reaction_accuracy: Any = None,
           budget: Any = None) -> dict[str, Any]:
    def whole(value: Any, name: str) -> Optional[int]:
        return None if value is None else _arrays.whole(value, name, 0, 30)

    def real(value: Any, name: str) -> Optional[float]:
        return None if value is None else _arrays.real(value, name)

    return {
        "level": whole(level, "level"),
        "coarser_by": whole(coarser_by, "coarser_by"),
        "accuracy": real(accuracy, "accuracy"),
        "reaction_accuracy": real(reaction_accuracy, "reaction_accuracy"),
        "budget": real(budget, "budget"),
    }


def _warn(messages: list[str], of: Any = None, stacklevel: int = 3) -> None:
    """Where warnings are errors, the first has as `result` what was found all the same."""
    for message in messages:
        try:
            warnings.warn(message, Warning, stacklevel=stacklevel)
        except Warning as warning:
            setattr(warning, "result", of)
            raise


def _digest(data: bytes, name: str) -> str:
    return f"{hashlib.sha256(data).hexdigest()}  {name}"


def _history(call: str, lattice: Any, scene: Any, read: _core.Scene) -> str:
    """The call, then a line for each file and text that it read, as the tools have it."""
    lines = [f"{call} of Python"]
    if isinstance(lattice, (str, os.PathLike)):
        lines.append(f"{_core.content_checksum(os.fspath(lattice))}  {os.fspath(lattice)}")
    if isinstance(scene, Mapping):
        lines.append(_digest(toml_of(scene).encode(), "a scene of Python, as TOML"))
    elif isinstance(scene, str) and is_text(scene):
        lines.append(_digest(scene.encode(), "a scene of Python"))
    files = [os.fspath(scene)] if isinstance(scene, os.PathLike) or (isinstance(scene, str) and not is_text(scene)) else []
    for file in [*files, *(os.fspath(named) for named in read.files)]:
        with open(file, "rb") as opened:
            lines.append(_digest(opened.read(), file))
    return "\n".join(lines)


def _rising(progress: Optional[Callable[[dict[str, Any]], object]]) -> Optional[Callable[[dict[str, Any]], object]]:
    """Tells parts that do not go back: a level may turn out to need a coarser one first."""
    if progress is None:
        return None
    teller, most = progress, 0.0

    def tell(told: dict[str, Any]) -> None:
        nonlocal most
        if told["part"] is not None:
            told["part"] = most = max(most, told["part"])
        teller(told)

    return tell


def _check_level(lattice: Lattice, level: Optional[int]) -> None:
    if level is not None and level >= len(lattice.levels):
        raise UsageError(f"level is {level}, expected 0 to {len(lattice.levels) - 1}")


def _check_callable(progress: Any) -> None:
    if progress is not None and not callable(progress):
        raise UsageError(f"progress is of type {type(progress).__name__}, expected a function")


def solve(
    lattice: Union[Lattice, str, os.PathLike[str]],
    scene: Scene,
    *,
    level: Optional[int] = None,
    coarser_by: Optional[int] = None,
    accuracy: Optional[float] = None,
    reaction_accuracy: Optional[float] = None,
    budget: Optional[float] = None,
    progress: Optional[Callable[[dict[str, Any]], object]] = None,
    folder: Union[str, os.PathLike[str], None] = None,
) -> Result:
    """Solve a lattice under a scene: what `hexsolve` does, with the same numbers.

    lattice: a Lattice, or a file of one
    scene: a mapping {"fix": [{"name": ..., "point_mm": ..., "radius_mm": ...}], ...}, TOML, or a file; the keys are
        those of scene files
    level, accuracy [mm], reaction_accuracy [1], budget [s]: one of them, in place of what the scene asks for
    coarser_by: graded cells, up to that many levels coarser where nothing happens
    progress: called after every Newton step, or step of a motion, with a dict: level, step, part (done, 0 to 1, or
        None), load, residual, linear_iterations, or time [s]. What it raises ends the solution
    folder: that files named in the scene are relative to; of a scene file its own

    The interpreter is free meanwhile, and Ctrl-C works. Raises UsageError, InputError, GeometryError, and NotConverged,
    whose `result` is the last state that did.
    """
    _check_callable(progress)
    asked = _asked(level, coarser_by, accuracy, reaction_accuracy, budget)
    of, read = _lattice(lattice), _scene(scene, folder)
    named = [f"{key}={value:g}" for key, value in asked.items() if value is not None]
    _check_level(of, level)
    history = _history(f"hextools.solve({', '.join(named)})", lattice, scene, read)
    result, messages, missing = _core.solve(of, read, asked, _rising(progress), [history])
    _warn(messages, result)
    if missing:
        raise NotConverged(missing, result)
    return result


def check(lattice: Union[Lattice, str, os.PathLike[str]], scene: Scene, *, level: Optional[int] = None,
          folder: Union[str, os.PathLike[str], None] = None) -> dict[str, Any]:
    """What each condition of a scene selects, without solving: the dict of `hexsolve --check --report`.

    Raises GeometryError where a part is not held or a point is off the body.
    """
    found: dict[str, Any] = _core.check(_lattice(lattice), _scene(scene, folder), _asked(level))
    return found


def plan(lattice: Union[Lattice, str, os.PathLike[str]], scene: Scene, *, level: Optional[int] = None,
         accuracy: Optional[float] = None, budget: Optional[float] = None,
         folder: Union[str, os.PathLike[str], None] = None) -> dict[str, Any]:
    """Which effects are on, why, and what a solution is expected to cost: the dict of `hexsolve --plan --report`."""
    asked = _asked(level, accuracy=accuracy, budget=budget)
    planned: dict[str, Any] = _core.plan(_lattice(lattice), _scene(scene, folder), asked)
    return planned


def example_scene(lattice: Union[Lattice, str, os.PathLike[str]]) -> str:
    """A commented scene (TOML) for any lattice: three places held, a fourth pulled."""
    return _core.example_scene(_lattice(lattice))


class Motion:
    """A motion that goes on step by step, to its duration: iterating gives the state at the start, then that after each
    step that is left. Threads may share one: each step is one thread's.

    A state is a dict: time [s], displacement (num_nodes, 3) [mm], velocity (num_nodes, 3) [mm/s], energies [N mm],
    work [N mm], momentum [N s], contacts; the arrays are its own.
    """

    def __init__(self, lattice: Union[Lattice, str, os.PathLike[str]], scene: Scene, *, level: Optional[int] = None,
                 folder: Union[str, os.PathLike[str], None] = None, _stacklevel: int = 3) -> None:
        of, asked = _lattice(lattice), _asked(level)
        _check_level(of, level)
        self._motion = _core.Motion(of, _scene(scene, folder), asked)
        _warn(self._motion.warnings, self, _stacklevel)

    def __repr__(self) -> str:
        return f"<hextools.Motion after {self.steps} of {self.num_steps} steps>"

    @property
    def num_steps(self) -> int:
        """Of the whole motion."""
        return self._motion.num_steps

    @property
    def steps(self) -> int:
        """Taken so far."""
        return self._motion.steps()

    @property
    def nodes(self) -> Any:
        """Positions at rest [mm]: shape (num_nodes, 3)."""
        return self._motion.nodes

    @property
    def state(self) -> dict[str, Any]:
        """The state as it is now."""
        return self._motion.state()

    def step(self) -> Optional[dict[str, Any]]:
        """Go on by one step of [dynamics] step_s; None at the end. Raises NotConverged where no part of it can be
        solved; the state is then the last that could."""
        state = self._motion.step()
        if state is None and self.steps < self.num_steps:
            raise NotConverged(f"not converged: {self._motion.reason()}")
        return state

    def __iter__(self) -> Iterator[dict[str, Any]]:
        if self.steps == 0:
            yield self.state
        while (state := self.step()) is not None:
            yield state


def motion(lattice: Union[Lattice, str, os.PathLike[str]], scene: Scene, *, level: Optional[int] = None,
           folder: Union[str, os.PathLike[str], None] = None) -> Motion:
    """The motion of a scene with [dynamics], step by step; solve() gives all of it at once, as a Result.

        for state in hextools.motion(lattice, "fall.toml", level=2):
            print(state["time"], state["energies"]["kinetic"])
    """
    return Motion(lattice, scene, level=level, folder=folder, _stacklevel=4)


def read_result(path: Union[str, os.PathLike[str]]) -> Result:
    """Read a result file of `hexsolve` or `hexfit`. Raises InputError."""
    return _core.read_result(os.fspath(path))
