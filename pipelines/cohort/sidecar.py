#!/usr/bin/env python3
"""The JSON beside an output: what it is, what it was made from, by what, and the tool's own report.

usage: sidecar.py FILE --describe TEXT --source FILE... [--report JSON]     (the report is moved into it)
       sidecar.py --dataset FILE                                            (dataset_description.json)
"""
import argparse
import json
import os
import subprocess


def generator():
    said = subprocess.run(["hexsolve", "--version"], capture_output=True, text=True, check=True).stdout
    return [{"Name": "hextools", "Version": said.strip().partition(" ")[2]}]  # without the tool's name


parser = argparse.ArgumentParser()
parser.add_argument("file")
parser.add_argument("--dataset", action="store_true")
parser.add_argument("--describe")
parser.add_argument("--source", nargs="+", default=[])
parser.add_argument("--report")
arguments = parser.parse_args()

out = {"GeneratedBy": generator()}
if arguments.dataset:
    out = {"Name": "Equilibria of segmented scans", "BIDSVersion": "1.8.0", "DatasetType": "derivative", **out}
else:
    out = {"Description": arguments.describe, "Sources": arguments.source, "Units": "mm, N, kPa, patient LPS", **out}
if arguments.report:
    with open(arguments.report) as report:
        out["Report"] = json.load(report)
with open(arguments.file + ".new", "w") as file:
    json.dump(out, file, indent=2)
    file.write("\n")
os.replace(arguments.file + ".new", arguments.file)
if arguments.report:
    os.remove(arguments.report)
