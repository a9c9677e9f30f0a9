#!/usr/bin/env python3
"""The cases of a cohort, from a table or a folder, into cases.json with what steps depend on.

usage: cases.py TABLE.tsv|FOLDER OUT [scene=FILE] [segment=S] [materials=FILE] [level=N] [processes=N]
"""
import csv
import json
import os
import pathlib
import re
import sys

COLUMNS = ["participant_id", "segmentation", "segment", "ct", "spacing", "scene"]
ENDINGS = [".seg.nrrd", ".nrrd", ".nhdr", ".nii.gz", ".nii", ".mha", ".mhd", ".vti", ".dcm", ".obj", ".stl", ".ply", ".off", ".vtp"]


def fail(message):
    print(f"cohort.sh: {message}", file=sys.stderr)
    sys.exit(3)


def label_of(name):
    """What BIDS allows in an entity: letters and digits."""
    return re.sub("[^A-Za-z0-9]", "", name)


def stamp(path):
    """What changes where a file, or one in a folder, does."""
    path = pathlib.Path(path)
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return [[f.name, f.stat().st_mtime_ns, f.stat().st_size] for f in files if f.is_file()]


def from_table(path):
    with open(path, newline="", encoding="utf-8-sig") as table:
        rows = csv.DictReader(table, delimiter="\t")
        unknown = sorted(set(rows.fieldnames or []) - set(COLUMNS))
        if unknown or not {"participant_id", "segmentation"} <= set(rows.fieldnames or []):
            fail(f"'{path}' has the columns {rows.fieldnames}, expected participant_id, segmentation and any of {', '.join(COLUMNS[2:])}")
        for row in rows:
            row = {key: (value or "").strip() for key, value in row.items() if key}
            for column in ("ct", "scene"):
                if row.get(column):
                    row[column] = str((path.parent / row[column]).resolve())
            inputs = [str((path.parent / name.strip()).resolve()) for name in row["segmentation"].split(";") if name.strip()]
            yield row["participant_id"].removeprefix("sub-"), {**row, "inputs": inputs}


def from_folder(path, out):
    for entry in sorted(path.iterdir()):
        ending = next((e for e in ENDINGS if entry.name.lower().endswith(e)), "")
        if entry.name.startswith(".") or entry.resolve() == out or not (entry.is_dir() or ending):
            continue
        yield entry.name[: len(entry.name) - len(ending)], {"inputs": [str(entry.resolve())]}


def problem_of(name, case, cases):
    """What is wrong with a case before any step of it; empty if nothing is."""
    if not label_of(name):
        return f"its name '{name}' has no letters or digits"
    if label_of(name) in cases:
        return f"another case is called '{label_of(name)}' too"
    if not case["inputs"]:
        return "it has no segmentation"
    missing = [f for f in [*case["inputs"], case.get("ct"), case.get("scene")] if f and not os.path.exists(f)]
    return f"no such file '{missing[0]}'" if missing else ""


def main():
    path, out = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    settings = dict(word.split("=", 1) for word in sys.argv[3:])
    for key, least in (("level", 0), ("processes", 1)):
        if key in settings and not (settings[key].isdigit() and int(settings[key]) >= least):
            fail(f"--{key} is {settings[key]}, expected a number from {least} on")
    cases = {}
    for name, case in from_folder(path, out) if path.is_dir() else from_table(path):
        problem = problem_of(name, case, cases)
        label = label_of(name) or "unnamed"
        while label in cases:
            label += "again"
        case = {key: case.get(key, "") for key in ["inputs", *COLUMNS[2:]]}
        for key in ("scene", "segment"):
            case[key] = case[key] or settings.get(key, "")
        case["problem"] = problem
        case["stamps"] = {key: [stamp(f) for f in files if f and os.path.exists(f)]
                          for key, files in (("inputs", case["inputs"]), ("ct", [case["ct"]]), ("scene", [case["scene"]]),
                                             ("materials", [settings.get("materials", "")]))}
        cases[label] = case
    results = re.compile(re.escape(str(out)) + r"/(sub-.*|summary\.(tsv|json|html)|cases\.json|dataset_description\.json)")
    named = [str(path), *(settings.get(key, "") for key in ("scene", "materials"))]
    for case in cases.values():
        named += [*case["inputs"], case["ct"], case["scene"]]
    for file in named:
        if file and results.fullmatch(os.path.realpath(file)):
            fail(f"input '{file}' is what this run writes, expected one outside of '{out}' or another folder for -o")
    if not cases:
        fail(f"'{path}' holds no cases, expected files that end in {', '.join(ENDINGS)} or folders of DICOM files")
    new = out / "cases.json.new"
    new.write_text(json.dumps({"settings": settings, "cases": cases}, indent=1))
    new.replace(out / "cases.json")


main()
