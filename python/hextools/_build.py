# SPDX-License-Identifier: Apache-2.0
"""From arrays to a lattice."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Union

import numpy as np

from . import _arrays, _core
from ._core import Lattice
from ._text import is_text, string_of, toml_of
from .errors import InputError, UsageError

_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False, repr=False)
class Volume:
    """Voxels in the patient: voxel (i, j, k) is centred at `origin + direction @ (spacing * (i, j, k))` [mm], LPS.

    values: shape (ni, nj, nk), labels or grey values
    spacing: edges of a voxel along i, j, k [mm]
    origin: centre of voxel (0, 0, 0) [mm]
    direction: shape (3, 3); its columns are the directions of i, j, k
    segments: the name of each label, if the values are labels
    """

    values: Any
    spacing: Sequence[float] = (1.0, 1.0, 1.0)
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    direction: Any = _IDENTITY
    segments: Mapping[int, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        voxels = " x ".join(str(n) for n in np.shape(self.values))
        spacing = " x ".join(f"{float(s):.4g}" for s in self.spacing)
        return f"<hextools.Volume of {voxels} voxels of {spacing} mm>"


def _segments(segments: Any) -> dict[int, tuple[str, Any, str]]:
    if not isinstance(segments, Mapping):
        raise UsageError(f"segments is of type {type(segments).__name__}, expected a mapping of labels to names")
    out = {}
    for label, segment in segments.items():
        number = _arrays.whole(label, "a label of segments", 1, 65535)
        if isinstance(segment, str):
            string_of(segment)
        meaning = {"name": segment} if isinstance(segment, str) else segment
        if not isinstance(meaning, Mapping) or set(meaning) - {"name", "color", "terminology"}:
            raise UsageError(f"segments[{number}] is {segment!r}, expected a name or name, color and terminology")
        name, terminology = meaning.get("name"), meaning.get("terminology", "")
        if not isinstance(name, str) or not name or not isinstance(terminology, str):
            raise UsageError(f"segments[{number}] is {segment!r}, expected texts for its name and terminology")
        color = meaning.get("color")
        if color is not None:
            color = _arrays.vector(color, f"the color of segments[{number}]")
            if not all(0 <= part <= 1 for part in color):
                raise UsageError(f"the color of segments[{number}] is {color}, expected red, green, blue in [0, 1]")
        out[number] = (name, color, terminology)
    return out


def _material(choice: Any, name: str) -> Any:
    if choice is None:
        return {"none": True}
    if isinstance(choice, str):
        return {"tissue": choice}
    if not isinstance(choice, Mapping):
        raise UsageError(f"materials[{name!r}] is {choice!r}, expected a mapping, the name of a tissue, or None")
    return choice


def _materials(materials: Any, segments: Mapping[int, tuple[str, Any, str]]) -> tuple[str, str, bool]:
    """TOML, its name in messages, whether they name its lines."""
    if materials is None:
        return "", "materials", False
    if isinstance(materials, str) and is_text(materials):
        return materials, "materials", True
    if isinstance(materials, (str, os.PathLike)):
        path = Path(materials)
        try:
            return path.read_text(encoding="utf-8"), str(path), True
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"materials '{path}' cannot be read: {error}") from None
    if not isinstance(materials, Mapping):
        raise UsageError(f"materials is of type {type(materials).__name__}, expected a mapping or a file (TOML)")
    named = {}
    for key, choice in materials.items():
        name = key
        if not isinstance(key, str):
            label = _arrays.whole(key, "a label of materials", 1, 65535)
            name = segments[label][0] if label in segments else f"label_{label}"
        named[name] = _material(choice, name)
    return toml_of({"material": named}), "materials", False


def build(
    labels: Any,
    *,
    spacing: Any = None,
    origin: Any = None,
    direction: Any = None,
    segments: Union[Mapping[int, Any], None] = None,
    materials: Any = None,
    intensity: Any = None,
    levels: int = 0,
    offset: Any = (0, 0, 0),
    cell_size: float = 0,
    gaps: str = "split",
) -> Lattice:
    """Build the lattice of a segmented scan: what `hexmesh build` does, with the same numbers.

    labels: whole numbers [i, j, k], 0 = background, of any type and memory order; or a Volume
    spacing, origin, direction: as of Volume, in its place; LPS, mm
    segments: names of labels, {1: "liver"}, or {1: {"name": ..., "color": ..., "terminology": ...}}; by default
        label_1, ...
    materials: what segments are made of, by name or label ("*": all others): {"young_kpa": 3, "poisson": 0.45,
        "density_kg_m3": 1060}, the name of a tissue, or None for one that only serves boundary conditions; laws that
        follow the grey values as in a materials file; or such a file, or its text. Without one the segment's name chooses a tissue
    intensity: grey values that materials follow: an array on the grid of the labels, or a Volume
    levels: number of levels; 0: until at most 16 cells are left
    offset: shift of the lattice against the body, in voxels
    cell_size: edge of cubic cells that some level has exactly [mm]; the labels are resampled once for it
    gaps: "split": cells are several where gaps part the material in them, so that gaps open at every level; "tie":
        they hold it together

    Raises UsageError, InputError.
    """
    given = {"spacing": spacing, "origin": origin, "direction": direction, "segments": segments}
    if isinstance(labels, Volume):
        twice = [name for name, value in given.items() if value is not None]
        if twice:
            raise UsageError(f"{' and '.join(twice)} and a Volume, which has that itself: expected one of them")
        volume = labels
    else:
        volume = Volume(labels, **{name: value for name, value in given.items() if value is not None})
    values = _arrays.labels(volume.values)
    grid = _grid(volume, "")
    named = _segments(volume.segments)
    text = _materials(materials, named)
    grey = None
    if intensity is not None:
        if isinstance(intensity, Volume):
            grey = _scan(intensity)
        else:
            grey = (_arrays.grey_values(intensity), *grid)
            if grey[0].shape != values.shape:
                raise UsageError(f"intensity has shape {grey[0].shape}, expected that of the labels, {values.shape}, "
                                 "or a Volume with a grid of its own")
    shift = _array_of_three(offset)
    size = _arrays.real(cell_size, "cell_size")
    if not (size == 0 or (np.isfinite(size) and size > 0)):
        raise UsageError(f"cell_size is {size:g}, expected a number > 0 in mm, or 0 for the scan's own")
    if gaps not in ("split", "tie"):
        raise UsageError(f"gaps is {gaps!r}, expected 'split' or 'tie'")
    lattice = _core.build(values, *grid, named, text, grey, _arrays.whole(levels, "levels", 0, 20), shift, size,
                          gaps == "split")
    lattice.history = ["hextools.build() of Python"]
    return lattice


def _grid(volume: Volume, of: str) -> tuple[Any, Any, Any]:
    return (_arrays.vector(volume.spacing, f"the spacing {of}".strip()),
            _arrays.vector(volume.origin, f"the origin {of}".strip()),
            _arrays.matrix(volume.direction, f"the direction {of}".strip()))


def _scan(scan: Any) -> tuple[Any, Any, Any, Any]:
    """Grey values and grid of a Volume, for C++."""
    if not isinstance(scan, Volume):
        raise UsageError(f"the scan is of type {type(scan).__name__}, expected a Volume")
    return (_arrays.grey_values(scan.values, "the scan"), *_grid(scan, "of the scan "))


def _array_of_three(offset: Any) -> tuple[int, int, int]:
    numbers = list(offset) if isinstance(offset, (list, tuple, np.ndarray)) else []
    if len(numbers) != 3:
        raise UsageError(f"offset is {offset!r}, expected three whole numbers")
    i, j, k = (_arrays.whole(n, "offset", 0, 4096) for n in numbers)
    return i, j, k


def read_lattice(path: Union[str, os.PathLike[str]]) -> Lattice:
    """Read a lattice file of `hexmesh build`. Raises InputError."""
    return _core.read_lattice(os.fspath(path))
