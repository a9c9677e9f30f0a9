#!/usr/bin/env bash
# What the scan costs a coarse solution: instructions, bytes read, memory and size of the result, with and without an
# estimate of the error. None depends on what else the machine does.
#
# usage: pipelines/reading.sh LATTICE SCENE >reading.csv
set -euo pipefail
. "$(dirname "$0")/common.sh"
lattice=$(realpath "$1") scene=$(realpath "$2")
export OMP_NUM_THREADS=1
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cd "$folder"
echo level,cells,error_estimate,instructions,bytes_read,memory_mb,result_bytes
for level in 5 4 3 2; do
  for estimate in off look; do
    solve=(hexsolve -q "$lattice" "$scene" --level "$level" --set solve.strain=cauchy --set "solve.error_estimate=$estimate"
      --report report.json -o result.hexresult --force)
    read_by() { bash -c '"$@" && cat /proc/$$/io' _ "$@" | sed -n 's/rchar: //p'; }
    instructions=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null "${solve[@]}" 2>&1 | sed -n 's/.*Collected : //p')
    bytes=$(($(read_by "${solve[@]}") - $(read_by true)))  # its report is the one that is read
    python3 - "$level" "$estimate" "$instructions" "$bytes" <<'TEXT'
import json, os, sys
level, estimate, instructions, read = sys.argv[1:]
report = json.load(open("report.json"))
print(level, report["lattice"]["cells"], estimate, instructions, read, round(report["peak_memory_mb"], 1), os.path.getsize("result.hexresult"), sep=",")
TEXT
  done
done
