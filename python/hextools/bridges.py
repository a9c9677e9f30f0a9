# SPDX-License-Identifier: Apache-2.0
"""From and to the images, grids and tables of SimpleITK, nibabel, PyVista and pandas, where these are installed.

All of them keep to hextools' axes: arrays [i, j, k], positions LPS in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Union

import numpy as np

from . import _arrays
from ._build import Volume
from ._core import Lattice, Result
from .errors import UsageError

_LPS_OF_RAS = np.array([-1.0, -1.0, 1.0])
_RAS_OF_LPS = _LPS_OF_RAS.astype(np.float32)


def from_sitk(image: Any, segments: Union[Mapping[int, Any], None] = None) -> Volume:
    """A SimpleITK image as a Volume, without a copy. segments: the names of its labels, if it has labels."""
    import SimpleITK as sitk

    values = sitk.GetArrayViewFromImage(image).transpose(2, 1, 0)
    direction = np.reshape(image.GetDirection(), (3, 3))
    return Volume(values, image.GetSpacing(), image.GetOrigin(), direction, segments or {})


def to_sitk(volume: Volume) -> Any:
    """A Volume as a SimpleITK image; one with values [i, j, k, axis], as Result.warp() gives, as an image of vectors,
    which SimpleITK.DisplacementFieldTransform takes in double precision."""
    import SimpleITK as sitk

    values = np.asarray(volume.values)
    if values.ndim not in (3, 4):
        raise UsageError(f"the volume has shape {values.shape}, expected [i, j, k] or [i, j, k, axis]")
    image = sitk.GetImageFromArray(np.ascontiguousarray(np.swapaxes(values, 0, 2)), isVector=values.ndim == 4)
    image.SetSpacing([float(s) for s in volume.spacing])
    image.SetOrigin([float(x) for x in volume.origin])
    image.SetDirection([float(d) for d in np.ravel(volume.direction)])
    return image


def from_nibabel(image: Any, segments: Union[Mapping[int, Any], None] = None) -> Volume:
    """A nibabel image, whose axes are RAS, as a Volume. segments: the names of its labels, if it has labels."""
    affine = np.asarray(getattr(image, "affine", None), dtype=float)
    if affine.shape != (4, 4):
        raise UsageError(f"{type(image).__name__} has no affine, expected an image of nibabel.load()")
    units = image.header.get_xyzt_units()[0] if hasattr(image.header, "get_xyzt_units") else "mm"
    to_mm = {"meter": 1e3, "micron": 1e-3}.get(units, 1.0)
    edges = to_mm * _LPS_OF_RAS[:, None] * affine[:3, :3]
    spacing = np.linalg.norm(edges, axis=0)
    if not (np.isfinite(affine).all() and (spacing > 0).all()):
        raise UsageError(f"the image has the affine {affine.tolist()}, expected one of finite voxels")
    values = np.asanyarray(image.dataobj)
    while values.ndim > 3 and values.shape[-1] == 1:
        values = values[..., 0]
    return Volume(values, _three(spacing), _three(to_mm * _LPS_OF_RAS * affine[:3, 3]), edges / spacing, segments or {})


def to_nibabel(volume: Volume) -> Any:
    """A Volume as a nibabel Nifti1Image, whose axes are RAS; displacements of Result.warp() as an image of vectors, RAS
    too."""
    import nibabel

    affine = np.eye(4)
    affine[:3, :3] = _LPS_OF_RAS[:, None] * np.asarray(volume.direction) * np.asarray(volume.spacing)
    affine[:3, 3] = _LPS_OF_RAS * np.asarray(volume.origin)
    values = np.asarray(volume.values)
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    elif values.dtype.kind in "iu" and values.itemsize == 8:
        narrow = values.astype(np.int32)
        if not np.array_equal(narrow, values):
            raise UsageError(f"the volume has values up to {values.max()}, expected those of 32 bits in NIfTI")
        values = narrow
    elif values.dtype == np.float16:
        values = values.astype(np.float32)
    vectors = values.ndim == 4  # axes of NIfTI: i, j, k, time, component
    image = nibabel.Nifti1Image((values * _RAS_OF_LPS)[:, :, :, None, :] if vectors else values, affine)
    if vectors:
        image.header.set_intent("vector")
    image.header.set_xyzt_units("mm")
    return image


def to_pyvista(of: Union[Lattice, Result], level: int = 0) -> Any:
    """Cells as a pyvista.UnstructuredGrid: of a Result with displacement at its points and its fields at cells, of a
    Lattice those of a level. `grid.warp_by_vector("displacement")` shows the deformed body."""
    import pyvista

    data: dict[str, Any]
    if isinstance(of, Result):
        cells, nodes, data = of.cell_nodes, of.nodes, {"segment": of.segment, **of.fields}
    elif isinstance(of, Lattice):
        number = _arrays.whole(level, "level", 0, len(of.levels) - 1)
        shown = of.levels[number]
        cells, nodes = shown.cell_nodes, shown.nodes
        data = {"segment": shown.segment, "fill": shown.fill, "parts": shown.parts}
    else:
        raise UsageError(f"{type(of).__name__} has no cells, expected a Lattice or a Result")
    around = np.asarray(cells)[:, [0, 1, 3, 2, 4, 5, 7, 6]]  # VTK goes around the faces of a hexahedron
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: around}, np.asarray(nodes))
    for name, values in data.items():
        grid.cell_data[name] = values
    if isinstance(of, Result):
        for name in ("displacement", "rest_displacement", "velocity", "load", "contact_force"):
            if (values := getattr(of, name)) is not None:
                grid.point_data[name] = values
    return grid


def to_pandas(result: Result, rows: str = "cells") -> Any:
    """A pandas.DataFrame of a result: of its "cells" index, segment and fields; of its "nodes" positions and
    displacements [mm]; of its "conditions" what they held and the forces that took [N]."""
    import pandas

    if not isinstance(result, Result):
        raise UsageError(f"{type(result).__name__} has no rows, expected a Result")
    if rows == "conditions":
        return pandas.json_normalize(result.report.get("conditions", []))
    columns: dict[str, Any]
    if rows == "nodes":
        columns = {f"{name}_{axis}": values[:, n]
                   for name, values in (("position", result.nodes), ("displacement", result.displacement))
                   for n, axis in enumerate("xyz")}
        return pandas.DataFrame(columns)
    if rows == "cells":
        columns = {axis: result.cells[:, n] for n, axis in enumerate("ijk")}
        columns["segment"] = result.segment
        columns.update(result.fields)
        return pandas.DataFrame(columns)
    raise UsageError(f"rows is {rows!r}, expected 'cells', 'nodes' or 'conditions'")


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
