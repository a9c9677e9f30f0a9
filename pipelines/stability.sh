#!/usr/bin/env bash
# Every hard case with its figure and limit, and a picture of each family of cases.
#
# usage: pipelines/stability.sh [-o FOLDER] [--short]     (FOLDER defaults to stability)
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
cases=${HEXTOOLS_TESTS:-$here/../build/tests}/test_stability
folder=stability extent=full
while [ $# -gt 0 ]; do
  case "$1" in
    -o) folder=${2:?-o needs a folder}; shift 2 ;;
    --short) extent=short; shift ;;
    *) echo "unknown option '$1', expected -o FOLDER or --short" >&2; exit 2 ;;
  esac
done
[ -x "$cases" ] || { echo "no $cases, expected it from ./run build" >&2; exit 1; }
. "$here/python.sh"
mkdir -p "$folder"
rm -f "$folder"/records.*.jsonl "$folder"/log.*.txt "$folder"/[0-9][0-9]-*.png

# The cases are dealt out to as many processes as there are cores.
shards=$(nproc) status=0 running=()
export OMP_NUM_THREADS=1 HEXTOOLS_TESTS=$extent
for ((n = 0; n < shards; ++n)); do
  GTEST_TOTAL_SHARDS=$shards GTEST_SHARD_INDEX=$n HEXTOOLS_STABILITY_RECORDS=$folder/records.$n.jsonl \
    "$cases" >"$folder/log.$n.txt" 2>&1 &
  running+=($!)
done
for process in "${running[@]}"; do wait "$process" || status=1; done

"$python" "$here/stability/plot.py" "$folder" >"$folder/table.md"
cat "$folder/table.md"
echo "the table, pictures and logs are in $folder" >&2
[ $status -eq 0 ] || grep -h "^\[  FAILED  \]" "$folder"/log.*.txt | sort -u >&2
exit $status
