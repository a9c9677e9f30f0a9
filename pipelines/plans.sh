#!/usr/bin/env bash
# What hexsolve --plan expects of time and memory, against what the solutions take. On a machine with nothing else to do.
#
# usage: pipelines/plans.sh [-o FOLDER] [--only WORD]     (FOLDER defaults to plans; scenes whose name has WORD)
set -euo pipefail
. "$(dirname "$0")/common.sh"
here=$(cd "$(dirname "$0")" && pwd)
folder=plans only=
while [ $# -gt 0 ]; do
  case "$1" in
    -o) folder=$(file_name "${2:?-o needs a folder}"); shift 2 ;;
    --only) only=${2:?--only needs a word}; shift 2 ;;
    *) echo "unknown option '$1', expected -o FOLDER or --only WORD" >&2; exit 2 ;;
  esac
done
mkdir -p "$folder"
python3 "$here/plans/measure.py" "$folder" "$only" >"$folder/scenes.jsonl"
python3 "$here/plans/table.py" "$folder/scenes.jsonl" >"$folder/table.md"
cat "$folder/table.md"
echo "the table and all numbers are in $folder" >&2
