# SPDX-License-Identifier: Apache-2.0
"""How an organ deforms: from a segmented scan to a solved mechanical model.

    import hextools
    lattice = hextools.build(labels, spacing=(2, 2, 2), materials={1: {"young_kpa": 3, "poisson": 0.45}})
    result = hextools.solve(lattice, hextools.example_scene(lattice), level=1)
    result.displacement_at([[10, 20, 30]])

Positions and displacements are patient LPS in mm. What the tools hexmesh and hexsolve do has the same numbers here, and
files are read and written by both. Arrays are numpy's; those of lattices and results are read-only views.
"""

from __future__ import annotations

import os as _os

# Threads of OpenMP sleep soon at a barrier, as those of the tools do, where nobody has said otherwise. Its runtime
# reads this once, when it is loaded.
_is_asked = "OMP_WAIT_POLICY" in _os.environ or "GOMP_SPINCOUNT" in _os.environ
if not _is_asked:
    _os.environ["GOMP_SPINCOUNT"] = "1000"
from . import _core  # noqa: E402

if not _is_asked:
    del _os.environ["GOMP_SPINCOUNT"]

from . import errors  # noqa: E402
from ._build import Volume, build, read_lattice  # noqa: E402
from ._core import Lattice, Level, Result  # noqa: E402
from ._solve import Motion, check, example_scene, motion, plan, read_result, solve  # noqa: E402
from .bridges import from_nibabel, from_sitk, to_nibabel, to_pandas, to_pyvista, to_sitk  # noqa: E402
from .markups import read_markups, write_markups  # noqa: E402
from .errors import Error, GeometryError, InputError, NotConverged, OutputError, UsageError, Warning  # noqa: E402

__version__: str = _core.__version__


def set_threads(count: int) -> None:
    """How many threads calls use from now on; 0: as many as the process may run on. Results do not depend on it."""
    from . import _arrays

    _core.set_threads(_arrays.whole(count, "count", 0, 1024))


def set_max_memory(megabytes: float) -> None:
    """Refuse what is foreseen to take more memory than this beside what the process has now; at first four fifths of
    the machine's."""
    from . import _arrays

    value = _arrays.real(megabytes, "megabytes")
    if not value > 0:
        raise UsageError(f"megabytes is {value:g}, expected a number > 0")
    _core.set_max_memory(value)


__all__ = [
    "Error", "GeometryError", "InputError", "Lattice", "Level", "Motion", "NotConverged", "OutputError", "Result",
    "UsageError", "Volume", "Warning", "build", "check", "errors", "example_scene", "from_nibabel", "from_sitk",
    "motion", "plan", "read_lattice", "read_markups", "read_result", "set_max_memory", "set_threads", "solve", "to_nibabel",
    "to_pandas", "to_pyvista", "to_sitk", "write_markups",
]
