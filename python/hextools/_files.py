# SPDX-License-Identifier: Apache-2.0
"""Files and bytes of them: one thread of the process is in HDF5 at a time."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from . import _core


def file_lock() -> AbstractContextManager[Any]:
    """To be held where hextools reads or writes files: h5py may have the same copy of HDF5, and locks it with this."""
    objects = sys.modules.get("h5py._objects")
    lock: AbstractContextManager[Any] = getattr(objects, "phil", None) or nullcontext()
    return lock


def lattice_of_bytes(data: bytes) -> _core.Lattice:
    """What a pickled lattice is made from."""
    return _core._lattice_of_bytes(data)


def result_of_bytes(data: bytes) -> _core.Result:
    """What a pickled result is made from."""
    return _core._result_of_bytes(data)
