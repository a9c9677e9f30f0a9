#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference pages of the manual, made from what the tools' --help says.

usage: docs/make_reference.py [--bin FOLDER] [--check]

Writes docs/reference/TOOL.md of every tool. --check writes nothing and fails where a page is not what would be written.
FOLDER holds the executables, build/bin by default. The page of hexsolve-mpi is left alone where it is not built.
"""
import argparse
import difflib
import pathlib
import re
import subprocess
import sys

TOOLS = ["hexscan", "hexmesh", "hexsolve", "hexfit", "hexexport", "hexslice", "hexview", "hexbench", "hexsolve-mpi"]
NOT_EVERYWHERE = {"hexsolve-mpi"}
ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ROOT / "docs" / "reference"
REGENERATE = "python3 docs/make_reference.py --bin FOLDER_OF_THE_EXECUTABLES   (build/bin if that is left out)"
INDENT = 30  # where CLI11 begins what an option does

TYPES = {"TEXT": "text", "INT": "integer", "FLOAT": "number", "NUMBER": "number"}


def help_of(folder, words):
    return subprocess.run([str(folder / words[0]), *words[1:], "--help"], check=True, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL).stdout


def parse(text):
    """Description, usage, example, and sections: {title: [(left column, what it does)]}."""
    description, usage, sections, title = [], "", {}, None
    example, notes = "", []
    lines = text.splitlines()
    n = 0
    while n < len(lines):
        line = lines[n]
        n += 1
        if line.startswith("Usage: "):
            usage = line[len("Usage: "):]
        elif not usage:
            description.append(line)
        elif line == "Example:":
            example = lines[n].strip()
            notes = [note for note in lines[n + 1:] if note]
            break
        elif re.match(r"\S.*:$", line):
            title = line[:-1]
            sections[title] = []
        elif line.strip() and title is not None:
            if n < len(lines) and lines[n].startswith(" " * INDENT):
                sections[title].append((line.strip(), lines[n].strip()))
                n += 1
            else:
                sections[title].append((line[:INDENT].strip(), line[INDENT:].strip()))
    return " ".join(description).strip(), usage, example, notes, sections


def escaped(text):
    for sign, code in (("|", "\\|"), ("*", "\\*"), ("<", "&lt;")):
        text = text.replace(sign, code)
    return text


def value_in_words(value):
    """'FLOAT:FLOAT in [0 - 1]' as 'number from 0 to 1'."""
    kind, _, check = value.partition(":")
    count = re.match(r"(\S+) x (\d+)$", kind)
    if count:
        words = f"{count[2]} {TYPES.get(count[1], count[1])}s"
    else:
        words = TYPES.get(kind, kind.strip("[]"))
    bounds = re.match(r"(?:INT|FLOAT) in \[(\S+) - (\S+)\]$", check)
    if bounds:
        words += f" from {bounds[1]} to {bounds[2]}"
    elif check.startswith("{"):
        words = ", ".join(f"`{choice}`" for choice in check.strip("{}").split(","))
        return words
    elif check in ("POSITIVE", "NUMBER > 0"):
        words += " > 0"
    elif check == "NONNEGATIVE":
        words += " >= 0"
    elif check:
        words += " " + check
    return escaped(words)


def row_of(left, meaning):
    """Name, value, default and meaning of an option or argument."""
    name, _, rest = left.partition(" ")
    remarks = []
    for word, sentence in (("Needs", "Goes with"), ("Excludes", "Not with")):
        found = re.search(rf"\s*{word}: (.*?)(?=\s+[A-Z][a-z]+:|$)", rest)
        if found:
            remarks.append(f"{sentence} " + ", ".join(f"`{other}`" for other in found[1].split()) + ".")
            rest = rest[:found.start()] + rest[found.end():]
    required = rest.endswith("REQUIRED")
    rest = rest.removesuffix("REQUIRED").strip()
    often = rest.endswith("...")
    rest = rest.removesuffix("...").strip()
    rest = re.sub(r"^(INT|FLOAT|NUMBER):NUMBER", r"\1:NUMBER", rest)
    default = ""
    given = re.search(r"=(\S+)$", rest)
    if given:
        default, rest = given[1].strip("[]"), rest[:given.start()]
    told = re.search(r"\s*\[default: (.*)\]$", meaning)
    if told:
        default, meaning = default or told[1], meaning[:told.start()]
    value = value_in_words(rest) if rest else ""
    if often:
        value += " ..."
    if required:
        remarks.append("Required.")
    meaning = escaped(meaning)
    if remarks:
        meaning = (meaning if meaning.endswith(".") else meaning + ".") + " " + " ".join(remarks)
    name = ", ".join(f"`{one}`" for one in name.split(","))
    return name, value, f"`{default}`" if default else "", meaning


def table(items, first):
    rows = [row_of(*item) for item in items]
    with_default = any(row[2] for row in rows)
    heads = [first, "value"] + (["default"] if with_default else []) + ["what it does"]
    out = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for name, value, default, meaning in rows:
        out.append("| " + " | ".join([name, value] + ([default] if with_default else []) + [meaning]) + " |")
    return out


def body_of(sections, skip):
    out = []
    for title, items in sections.items():
        if title in skip:
            continue
        if title == "Positionals":
            out += ["Arguments:", "", *table(items, "argument"), ""]
        else:
            out += [f"{title}:", "", *table(items, "option"), ""]
    return out


def page_of(folder, tool):
    description, usage, example, notes, sections = parse(help_of(folder, [tool]))
    out = [f"# {tool}", "", "<!-- Made from --help by docs/make_reference.py: change the tool, not this page. -->", "",
           escaped(description), "", f"    usage:   {usage}", f"    example: {example}", ""]
    subcommands = sections.get("Subcommands", [])
    if subcommands:
        out += ["| subcommand | what it does |", "|---|---|"]
        out += [f"| [{tool} {name}](#{tool}-{name}) | {escaped(what)} |" for name, what in subcommands] + [""]
    out += body_of(sections, {"Subcommands"})
    for note in notes:
        out += [escaped(note), ""]
    out += ["What exit codes mean and what to do: [If something goes wrong](../problems.md).", ""]
    for name, _ in subcommands:
        description, usage, own_example, _, sections = parse(help_of(folder, [tool, name]))
        out += [f"## {tool} {name}", "", escaped(description) + ".", "", f"    usage:   {usage}"]
        out += [f"    example: {own_example}"] if own_example != example else []
        out += ["", *body_of(sections, {"Common"})]
    return "\n".join(out).rstrip("\n") + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "bin", help="folder of the executables")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where a page is out of date")
    arguments = parser.parse_args()
    folder = arguments.bin.resolve()
    stale = []
    for tool in TOOLS:
        path = PAGES / f"{tool}.md"
        if not (folder / tool).exists():
            if tool not in NOT_EVERYWHERE:
                sys.exit(f"no {tool} in {folder}, expected the executables from ./run build (--bin FOLDER)")
            print(f"{tool} is not built, {path.relative_to(ROOT)} is left as it is")
            continue
        page = page_of(folder, tool)
        there = path.read_text() if path.exists() else ""
        if page == there:
            continue
        if not arguments.check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(page)
            print(f"wrote {path.relative_to(ROOT)}")
            continue
        stale.append(str(path.relative_to(ROOT)))
        difference = difflib.unified_diff(there.splitlines(), page.splitlines(), stale[-1], f"{tool} --help", lineterm="", n=0)
        print("\n".join(difference))
    if stale:
        sys.exit(f"{', '.join(stale)}: not what --help says. Write them anew with\n  {REGENERATE}")


main()
