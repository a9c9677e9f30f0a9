# SPDX-License-Identifier: Apache-2.0
"""Points that are marked in 3D Slicer."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any, Optional, Union

from . import _arrays, _core
from .errors import UsageError

_SCHEMA = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#"


def read_markups(path: Union[str, os.PathLike[str]]) -> dict[str, Any]:
    """The first markup of a file of 3D Slicer (.mrk.json, .fcsv): {"type": "Fiducial", "Line", ..., "points": (n, 3)
    [mm], LPS}; of a ROI also "center" and "edges" (rows) [mm]. Raises InputError."""
    return _core.read_markup(os.fspath(path))


def write_markups(path: Union[str, os.PathLike[str]], points: Any, names: Optional[Sequence[str]] = None, *,
                  overwrite: bool = False) -> None:
    """Write points, (n, 3) [mm], LPS, as a point list of 3D Slicer (.mrk.json), e.g. where marked points have moved:
    `points + result.displacement_at(points)`. Raises UsageError, OutputError."""
    places = _arrays.points(points)
    labels = [str(n + 1) for n in range(len(places))] if names is None else [str(name) for name in names]
    if len(labels) != len(places):
        raise UsageError(f"{len(labels)} names for {len(places)} points, expected as many")
    control_points = [
        {"id": str(n + 1), "label": label, "position": place, "selected": True, "locked": False, "visibility": True,
         "positionStatus": "defined"}
        for n, (label, place) in enumerate(zip(labels, places.tolist()))
    ]
    markup = {"type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": "mm", "controlPoints": control_points}
    try:
        text = json.dumps({"@schema": _SCHEMA, "markups": [markup]}, indent=2, allow_nan=False)
    except ValueError:
        raise UsageError("points has values that are not finite, expected places in mm") from None
    _core.write_text(os.fspath(path), text + "\n", overwrite)
