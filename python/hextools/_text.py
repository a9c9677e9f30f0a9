# SPDX-License-Identifier: Apache-2.0
"""Scenes and materials given as mappings, as TOML."""

from __future__ import annotations

import json
import numbers
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from .errors import UsageError

_MOST_DEPTH = 32


def string_of(text: str) -> str:
    """A text as TOML. Raises UsageError for what UTF-8 cannot hold."""
    # JSON's escapes are TOML's; DEL has none in JSON.
    try:
        text.encode()
    except UnicodeEncodeError:
        raise UsageError(f"the text {text!a} is not Unicode, expected one that UTF-8 can hold") from None
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, name: str, depth: int) -> str:
    if depth > _MOST_DEPTH:
        raise UsageError(f"{name} is deeper than {_MOST_DEPTH}, expected tables and lists as scenes have them")
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, str):
        return string_of(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(_pairs(value, name, depth)) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item, name, depth + 1) for item in value) + "]"
    raise UsageError(f"{name} is of type {type(value).__name__}, expected a number, a text, a list or a mapping")


def _pairs(table: Mapping[Any, Any], name: str, depth: int) -> list[str]:
    pairs = []
    for key, value in table.items():
        if not isinstance(key, str):
            raise UsageError(f"{name or 'the scene'} has the key {key!r}, expected texts")
        if value is not None:  # as a key that is not there
            pairs.append(f"{string_of(key)} = {_value(value, f'{name}.{key}' if name else key, depth + 1)}")
    return pairs


def is_text(text: str) -> bool:
    """Whether it is TOML, and not the name of a file."""
    return text == "" or any(character in text for character in "\n=[")


def toml_of(table: Mapping[str, Any]) -> str:
    """A mapping as TOML, one key a line. Keys that are None are left out."""
    return "\n".join(_pairs(table, "", 0)) + "\n"
