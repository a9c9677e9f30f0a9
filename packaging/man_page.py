#!/usr/bin/env python3
"""The manual page of a tool, from what it and its subcommands say to --help: man_page.py TOOL VERSION DATE >TOOL.1"""
import os
import re
import subprocess
import sys

TOOLS = ["hexscan", "hexmesh", "hexsolve", "hexsolve-mpi", "hexfit", "hexexport", "hexslice", "hexview", "hexbench"]
TEXT_COLUMN = 30  # where help begins to explain, on the next line if the name is longer


class Help:
    """What --help says: description, usage, entries (name, text) by section, and the tail (example, exit codes, units)."""

    def __init__(self, command):
        said = subprocess.run(command + ["--help"], capture_output=True, text=True, check=True).stdout
        self.description, _, rest = said.partition("\nUsage: ")
        self.usage, _, rest = rest.partition("\n")
        body, _, tail = rest.partition("\nExample:\n")
        self.example, _, tail = tail.strip().partition("\n")
        self.exit_codes = re.search(r"^Exit codes: (.*)\.$", tail, re.M)[1].split(", ")
        self.units = re.search(r"^Units: (.*)$", tail, re.M)[1]
        self.sections = {}
        for title, lines in re.findall(r"^(\S.*):\n((?: +\S.*\n?)*)", body, re.M):
            self.sections[title] = entries(lines.splitlines())


def entries(lines):
    """(name, text) of each entry of a section; text that begins on the next line leaves the whole line to the name."""
    found = []
    for n, line in enumerate(lines):
        if line.startswith(" " * TEXT_COLUMN):
            name, text = found[-1]
            found[-1] = (name, (text + " " + line.strip()).strip())
        elif n + 1 < len(lines) and lines[n + 1].startswith(" " * TEXT_COLUMN):
            found.append((line.strip(), ""))
        else:
            found.append((line[:TEXT_COLUMN].strip(), line[TEXT_COLUMN:].strip()))
    return found


def prose(text):
    """Text that troff takes for nothing else; what begins with a dash is an option."""
    text = text.replace("\\", "\\e")
    text = re.sub(r"(?<![\w-])-(?=[\w-])", r"\\-", text).replace("\\--", "\\-\\-")
    return re.sub(r"^([.'])", r"\\&\1", text)


def literal(text):
    return prose(text).replace("-", "\\-").replace("\\\\-", "\\-").replace("'", "\\(aq")


def tagged(name, text):
    """An entry: options and commands bold, the value that follows in italics."""
    words, _, value = name.partition(" ")
    value = re.sub(r"\b([A-Z]+):\1\b", r"\1", value)  # FLOAT:FLOAT in [0 - 1]
    tag = f"\\fB{literal(words.replace(',', ', '))}\\fR" + (f" \\fI{literal(value)}\\fR" if value else "")
    return [".TP", tag, prose(text) or "\\&"]


def options(help, heading, skipped=()):
    out = []
    for title, section in help.sections.items():
        if title in skipped:
            continue
        out += [f"{heading} {title}"] if heading else [".PP", f"{title}:"]
        for entry in section:
            out += tagged(*entry)
    return out


def subcommand(tool, name, help):
    out = [f".SS {literal(tool)} {literal(name)}", prose(help.description) + ".", ".PP", usage(help)]
    return out + options(help, "")


def usage(help):
    tool, _, rest = help.usage.partition(" ")
    return f"\\fB{literal(tool)}\\fR {literal(rest)}"


def page(path, version, date):
    tool = os.path.basename(path)
    help = Help([path])
    subcommands = {name: Help([path, name]) for name, _ in help.sections.get("Subcommands", [])}
    summary = re.split(r"[:.]( |$)|, as ", re.sub(r" \(.*?\)", "", help.description))[0]
    out = [f'.TH {literal(tool.upper())} 1 "{date}" "hextools {version}" "User Commands"', ".SH NAME",
           f"{literal(tool)} \\- {prose(summary[0].lower() + summary[1:])}", ".SH SYNOPSIS", usage(help)]
    for sub in subcommands.values():
        out += [".br", usage(sub)]
    out += [".SH DESCRIPTION", prose(help.description), ".SH OPTIONS"]
    out += options(help, ".SS", skipped=["Subcommands"])
    if subcommands:
        out += [".SH COMMANDS", "Each takes the common options as well."]
        for name, sub in subcommands.items():
            out += subcommand(tool, name, sub)
    out += [".SH EXAMPLES", ".EX", literal(help.example.strip()), ".EE", ".SH EXIT STATUS"]
    for entry in help.exit_codes:
        code, _, meaning = entry.partition(" ")
        out += [".TP", f".B {code}", prose(meaning)]
    others = [f".BR {literal(other)} (1)" for other in TOOLS if other != tool]
    out += [".SH UNITS", prose(help.units), ".SH SEE ALSO"] + [other + "," for other in others[:-1]] + others[-1:]
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    sys.stdout.write(page(*sys.argv[1:]))
