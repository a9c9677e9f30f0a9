#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails where an include points from a room to one that stands above it, or where headers include each other in a circle,
and where a source is longer than 400 lines.

Rooms are listed from the ground up: a file may include headers of its own room and of those before it.
"""
import pathlib
import re
import sys

ROOMS = {
    "libhexmesh": ["core", "geometry", "volume", "lattice", "result", "warp", "file", "scan", "surface", "tetra", "view"],
    "libsolver": ["core", "scene", "report", "mesh", "selection", "match", "kernels", "terms", "constraints", "linear", "multigrid",
                  "newton", "level", "equilibrium", "dynamics", "plan", "baseline", "distributed"],
}
NAMES = {"libhexmesh": "hexmesh", "libsolver": "hexsolver"}  # include/NAME/ROOM/x.h
MOST_LINES = 400


def files_of(library):
    return sorted(path for path in library.glob("**/*") if path.suffix in (".h", ".cpp"))


def key_of(path, library):
    """ROOM/x.h or ROOM/x.cpp, as rooms know it."""
    parts = path.relative_to(library).parts
    return parts[1:] if parts[0] == "src" else parts[2:]


def own_includes(path, name):
    """Line and ROOM/x.h of what a file includes of its own library."""
    for line, text in enumerate(path.read_text().splitlines(), 1):
        found = re.match(rf'\s*#include "(?:{name}/)?([a-z_]+)/([a-z_]+\.h)"', text)
        if found:
            yield line, (found[1], found[2])


def wrong_rooms(library, name, rooms):
    for path in files_of(library):
        room = key_of(path, library)[0]
        if room not in rooms:
            yield f"{path}: '{room}' is no room, expected one of {', '.join(rooms)}"
            continue
        for line, (other, _) in own_includes(path, name):
            if other in rooms and rooms.index(other) > rooms.index(room):
                yield f"{path}:{line}: room {room} includes {other}, which stands above it"


def circles(library, name):
    includes = {}
    for path in files_of(library):
        if path.suffix == ".h":
            includes.setdefault(key_of(path, library), set()).update(key for _, key in own_includes(path, name))
    done = set()

    def visit(key, way):
        if key in way:
            yield f"{library}: headers in a circle: " + " -> ".join("/".join(k) for k in way[way.index(key):] + [key])
        elif key not in done:
            for other in sorted(includes.get(key, ())):
                yield from visit(other, way + [key])
            done.add(key)

    for key in sorted(includes):
        yield from visit(key, [])


def rooms_of_map(library):
    """Rooms named in the table of the library's README."""
    return set(re.findall(r"^\| `([a-z]+)/?` \|", (library / "README.md").read_text(), re.MULTILINE))


def main():
    source = pathlib.Path(sys.argv[1])
    wrong = []
    for library, rooms in ROOMS.items():
        wrong += wrong_rooms(source / library, NAMES[library], rooms)
        wrong += circles(source / library, NAMES[library])
        missing = set(rooms) - rooms_of_map(source / library)
        if missing:
            wrong.append(f"{library}/README.md: no row for the rooms {', '.join(sorted(missing))}")
    for folder in (*ROOMS, "tools"):
        for path in files_of(source / folder):
            lines = len(path.read_text().splitlines())
            if lines > MOST_LINES:
                wrong.append(f"{path}: {lines} lines, expected at most {MOST_LINES}")
    for line in wrong:
        print(line)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
