# SPDX-License-Identifier: Apache-2.0
"""Exceptions. Each has the text that the tools print, and as `exit_code` the code that they end with."""

from __future__ import annotations

from typing import Any


class Error(Exception):
    """Whatever hextools refuses or cannot do."""

    exit_code = 70


class UsageError(Error, ValueError):
    """An argument that no call takes."""

    exit_code = 2


class InputError(Error, ValueError):
    """A file, an array or a scene with something wrong in it."""

    exit_code = 3


class GeometryError(Error):
    """Selections, supports and what conflicts: a point off the body, a part that nothing holds."""

    exit_code = 4


class NotConverged(Error):
    """A solution that did not converge, or not to the accuracy asked. `result` is the last state that did."""

    exit_code = 5

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result


class OutputError(Error, OSError):
    """A file that cannot be written, or is there already."""

    exit_code = 6


class Warning(UserWarning):
    """What hextools assumed or noticed, as the tools warn of it."""
