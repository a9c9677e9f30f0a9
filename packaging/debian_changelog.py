#!/usr/bin/env python3
"""CHANGELOG.md in Debian's form: debian_changelog.py CHANGELOG.md PACKAGE 'NAME <MAIL>' >changelog"""
import datetime
import email.utils
import re
import sys
import textwrap

path, package, maintainer = sys.argv[1:]
with open(path) as file:
    releases = re.findall(r"^## \[([\d.]+)\] - (\S+)\n(.*?)(?=^## |\Z)", file.read(), re.M | re.S)
for version, date, text in releases:
    print(f"{package} ({version}) unstable; urgency=medium\n")
    for kind, points in re.findall(r"(?:^### (.*)\n+)?((?:^- .*\n(?:  .*\n)*)+)", text, re.M):
        if kind:
            print(f"  [ {kind} ]")
        for point in re.findall(r"^- (.*(?:\n  .*)*)", points, re.M):
            plain = re.sub(r"`|\*\*", "", " ".join(point.split()))
            print(textwrap.fill(plain, 78, initial_indent="  * ", subsequent_indent="    ",
                                break_on_hyphens=False))
    day = datetime.datetime.fromisoformat(date + "T12:00:00+00:00")
    print(f"\n -- {maintainer}  {email.utils.format_datetime(day)}\n")
