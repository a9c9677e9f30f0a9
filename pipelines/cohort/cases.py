#!/usr/bin/env python3
"""The cases of a cohort: from a table or a folder to JSON, {participant: {inputs, segment, ...}}.

usage: cases.py TABLE.tsv | FOLDER
"""
import csv
import json
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


def from_table(path):
    with open(path, newline="", encoding="utf-8") as table:
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


def from_folder(path):
    for entry in sorted(path.iterdir()):
        ending = next((e for e in ENDINGS if entry.name.lower().endswith(e)), "")
        if entry.name.startswith(".") or not (entry.is_dir() or ending):
            continue
        yield entry.name[: len(entry.name) - len(ending)], {"inputs": [str(entry.resolve())]}


def main():
    path = pathlib.Path(sys.argv[1])
    cases = {}
    for name, case in from_folder(path) if path.is_dir() else from_table(path):
        label = label_of(name)
        if not label:
            fail(f"a case of '{path}' is called '{name}', expected letters or digits in its name")
        if label in cases:
            fail(f"two cases of '{path}' are called '{label}', expected different names")
        if not case["inputs"]:
            fail(f"case '{label}' of '{path}' has no segmentation")
        cases[label] = {key: case.get(key, "") for key in ["inputs", *COLUMNS[2:]]}
    if not cases:
        fail(f"'{path}' holds no cases, expected files that end in {', '.join(ENDINGS)} or folders of DICOM files")
    json.dump(cases, sys.stdout, indent=1)


main()
