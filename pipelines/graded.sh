#!/usr/bin/env bash
# Errors of graded cells and of cells alike, against level 0, on eight positions of the lattice against the body.
#
# usage: pipelines/graded.sh [-o FOLDER]     (FOLDER defaults to graded)
set -euo pipefail
. "$(dirname "$0")/common.sh"
here=$(cd "$(dirname "$0")" && pwd)
folder=graded
while [ $# -gt 0 ]; do
  case "$1" in
    -o) folder=$(file_name "${2:?-o needs a folder}"); shift 2 ;;
    *) echo "unknown option '$1', expected -o FOLDER" >&2; exit 2 ;;
  esac
done
mkdir -p "$folder"
python3 "$here/graded/measure.py" "$folder" >"$folder/table.md"
cat "$folder/table.md"
echo "the table is in $folder" >&2
