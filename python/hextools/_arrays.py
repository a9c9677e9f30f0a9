# SPDX-License-Identifier: Apache-2.0
"""Arrays as C++ takes them, or a clear refusal."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import UsageError


def _array(value: Any, name: str) -> npt.NDArray[Any]:
    if isinstance(value, np.ma.MaskedArray):
        raise UsageError(f"{name} is a masked array, expected plain values, e.g. {name}.filled(0)")
    try:
        with np.errstate(all="ignore"):
            array = np.asarray(value)
    except Exception as error:  # whatever an object's own conversion raises
        raise UsageError(f"{name} is no array: {error}") from None
    if array.dtype.kind not in "biuf":
        raise UsageError(f"{name} has values of type {array.dtype}, expected numbers")
    return array


def _volume(value: Any, name: str) -> npt.NDArray[Any]:
    array = _array(value, name)
    if array.ndim != 3:
        raise UsageError(f"{name} has shape {array.shape}, expected three axes (i, j, k)")
    if array.size == 0:
        raise UsageError(f"{name} has shape {array.shape}, expected voxels")
    return array


def labels(value: Any) -> npt.NDArray[np.uint16]:
    """Whole numbers from 0 to 65535 of any type, i fastest in memory."""
    array = _volume(value, "labels")
    if array.dtype != np.uint16:
        low, high = array.min(), array.max()
        if not (low >= 0 and high <= 65535):  # NaN too
            raise UsageError(f"labels has values from {low} to {high}, expected 0 to 65535")
        if array.dtype.kind == "f" and not np.array_equal(array, np.floor(array)):
            raise UsageError("labels has values that are no whole numbers, expected labels")
    return np.asfortranarray(array, dtype=np.uint16)


def grey_values(value: Any, name: str = "intensity") -> npt.NDArray[np.float32]:
    """Single precision, i fastest in memory."""
    with np.errstate(over="ignore"):
        return np.asfortranarray(_volume(value, name), dtype=np.float32)


def points(value: Any) -> npt.NDArray[np.float64]:
    """Shape (n, 3)."""
    array = _array(value, "points")
    if array.ndim != 2 or array.shape[1] != 3:
        raise UsageError(f"points has shape {array.shape}, expected (n, 3)")
    return np.ascontiguousarray(array, dtype=np.float64)


def vector(value: Any, name: str) -> tuple[float, float, float]:
    """Three finite numbers."""
    array = _array(value, name)
    if array.shape != (3,):
        raise UsageError(f"{name} has shape {array.shape}, expected three numbers")
    if not np.isfinite(array).all():
        raise UsageError(f"{name} is {array.tolist()}, expected finite numbers")
    x, y, z = (float(v) for v in array)
    return x, y, z


def matrix(value: Any, name: str) -> list[tuple[float, float, float]]:
    """Three rows of three finite numbers; nine numbers row by row, as SimpleITK gives them, will do."""
    array = _array(value, name)
    if array.shape == (9,):
        array = array.reshape(3, 3)
    if array.shape != (3, 3):
        raise UsageError(f"{name} has shape {array.shape}, expected (3, 3)")
    return [vector(row, name) for row in array]


def whole(value: Any, name: str, low: int, high: int) -> int:
    """A whole number within bounds."""
    array = _array(value, name)
    if array.shape != () or array.dtype.kind not in "iu" or not low <= int(array) <= high:
        raise UsageError(f"{name} is {value!r}, expected a whole number from {low} to {high}")
    return int(array)


def real(value: Any, name: str) -> float:
    """A number."""
    array = _array(value, name)
    if array.shape != () or array.dtype.kind == "b":
        raise UsageError(f"{name} is {value!r}, expected a number")
    return float(array)
