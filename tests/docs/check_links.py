#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails where a relative link of a Markdown file points at no file, or at no heading of it, and where docs/README.md does
not link a page of the manual.

usage: check_links.py SOURCE_FOLDER
"""
import os
import pathlib
import re
import sys
import urllib.parse

# What builds and pipelines leave beside the sources.
LEFT_OUT = {"build", "build-dev", "build-fuzz", "build-package", "demo", "bench", "stability", "performance", "scaling"}


def pages_of(root):
    for folder, folders, names in os.walk(root):
        at_top = pathlib.Path(folder) == root
        folders[:] = [name for name in folders if not name.startswith(".") and not (at_top and name in LEFT_OUT)]
        yield from sorted(pathlib.Path(folder) / name for name in names if name.endswith(".md"))


def text_of(page):
    """The lines that are neither in a fenced block nor an indented one."""
    is_code, before = False, ""
    for line in page.read_text().splitlines():
        if line.lstrip().startswith("```"):
            is_code = not is_code
        elif not is_code and not (line.startswith("    ") and not before.strip()):
            yield line
            before = line


def without_code(line):
    return re.sub(r"`[^`]*`", "", line)


def anchor_of(heading):
    """What forges make of a heading."""
    words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", words).replace(" ", "-")


def anchors_of(page):
    return {anchor_of(line.lstrip("#")) for line in text_of(page) if re.match(r"#+ ", line)}


def links_of(page):
    for line in text_of(page):
        for target in re.findall(r"\]\(([^)\s]+)\)", without_code(line)):
            if not re.match(r"[a-z]+:", target):
                yield target


def main(root):
    errors, count, linked = [], 0, set()
    pages = list(pages_of(root))
    for page in pages:
        for link in links_of(page):
            count += 1
            name, _, anchor = urllib.parse.unquote(link).partition("#")
            target = (page.parent / name).resolve() if name else page
            if not target.exists() or not target.is_relative_to(root):
                errors.append(f"{page.relative_to(root)}: no such file '{link}'")
            elif anchor and target.suffix == ".md" and anchor not in anchors_of(target):
                errors.append(f"{page.relative_to(root)}: '{name or page.name}' has no heading '#{anchor}'")
            elif page == root / "docs" / "README.md":
                linked.add(target)
    for page in pages:
        if page.is_relative_to(root / "docs") and page != root / "docs" / "README.md" and page not in linked:
            errors.append(f"docs/README.md: no link to '{page.relative_to(root)}'")
    print(f"{count} links in {len(pages)} pages")
    if errors:
        sys.exit("\n".join(errors))


main(pathlib.Path(sys.argv[1]).resolve())
