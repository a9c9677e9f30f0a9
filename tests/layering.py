#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails where an include points from a room to one that stands above it, or around in a circle.

Rooms are listed from the ground up: a file may include its own room's headers and those of rooms before it.
"""
import pathlib
import re
import sys

SOLVER = ["core", "scene", "report", "mesh", "selection", "kernels", "terms", "constraints", "linear", "multigrid",
          "newton", "level", "equilibrium", "dynamics", "plan", "baseline", "distributed"]


def wrong_includes(root, public, rooms):
    place = {room: n for n, room in enumerate(rooms)}
    for path in sorted(root.glob("**/*")):
        if path.suffix not in (".h", ".cpp"):
            continue
        relative = path.relative_to(root)
        parts = relative.parts[1:] if relative.parts[0] == "src" else relative.parts[2:]
        if parts[0] not in place:
            yield f"{path}: '{parts[0]}' is no room, expected one of {', '.join(rooms)}"
            continue
        for line, text in enumerate(path.read_text().splitlines(), 1):
            found = re.match(rf'\s*#include "(?:{public}/)?([a-z_]+)/[a-z_]+\.h"', text)
            if not found or found[1] not in place:
                continue
            if place[found[1]] > place[parts[0]]:
                yield f"{path}:{line}: room {parts[0]} includes {found[1]}, which stands above it"


def main():
    source = pathlib.Path(sys.argv[1])
    wrong = list(wrong_includes(source / "libsolver", "hexsolver", SOLVER))
    for line in wrong:
        print(line)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
