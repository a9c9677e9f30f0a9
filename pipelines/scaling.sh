#!/usr/bin/env bash
# hexsolve-mpi with one and two processes on this machine: strong and weak scaling, a cost model fitted to them, and what
# it foretells of thousands of processes: a table, and scaling.csv.
#
# usage: pipelines/scaling.sh [-o FOLDER] [--short]     (FOLDER defaults to scaling)
set -euo pipefail
. "$(dirname "$0")/common.sh"
here=$(cd "$(dirname "$0")" && pwd)
folder=scaling spacings="4 3.175 2.52 2"
while [ $# -gt 0 ]; do
  case "$1" in
    -o) folder=$(file_name "${2:?-o needs a folder}"); shift 2 ;;
    --short) spacings="8 6.35"; shift ;;
    *) echo "unknown option '$1', expected -o FOLDER or --short" >&2; exit 2 ;;
  esac
done
mkdir -p "$folder"
cd "$folder"
rm -f run.*.{json,log,bytes}
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMP_NUM_THREADS=1

# Each spacing has twice the cells of the one before: equal loads per process are next to each other.
for spacing in $spacings; do
  hexscan -q phantom liver --spacing "$spacing" -o liver.nrrd --force
  hexmesh -q build liver.nrrd --material '*:young_kpa=100,poisson=0.3' -o liver.hexmesh --force
  hexsolve -q liver.hexmesh --example -o liver.toml --force
  for processes in 1 2; do
    echo "== $spacing mm, $processes processes" >&2
    mpiexec --oversubscribe -n "$processes" hexsolve-mpi -q liver.hexmesh liver.toml --level 0 --force \
      --report "run.$spacing.$processes.json" -o liver.hexresult -- -log_view ":run.$spacing.$processes.log"
    stat -c %s liver.hexresult >"run.$spacing.$processes.bytes"
  done
done
rm -f liver.nrrd liver.hexmesh liver.toml liver.hexresult
python3 "$here/scaling/model.py" . >scaling.md
cat scaling.md
echo "the table and scaling.csv are in $folder" >&2
