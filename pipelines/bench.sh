#!/usr/bin/env bash
# What accuracy, effects and motion cost, and the paper's tables and figures, on the phantom: JSON, CSV, tables, pictures.
#
# usage: pipelines/bench.sh [-o FOLDER] [--force]     (FOLDER defaults to bench)
set -euo pipefail
. "$(dirname "$0")/common.sh"
here=$(cd "$(dirname "$0")" && pwd)
folder=bench force=
while [ $# -gt 0 ]; do
  case "$1" in
    -o) folder=$(file_name "${2:?-o needs a folder}"); shift 2 ;;
    --force) force=--force; shift ;;
    *) echo "unknown option '$1', expected -o FOLDER or --force" >&2; exit 2 ;;
  esac
done
. "$here/python.sh"
command -v valgrind >/dev/null || { echo "no valgrind, expected Debian's valgrind" >&2; exit 1; }
mkdir -p "$folder"

# One thread for all: the tetrahedra have no parallel loops.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
cd "$folder"
{ hexsolve --version && date +%Y-%m-%d; } >about.txt
hexscan -q phantom liver --spacing 2 --intensity-out ct.nrrd -o liver.nrrd $force
hexmesh -q build liver.nrrd --material '*:young_kpa=100,poisson=0.3,density_kg_m3=1000' -o liver.hexmesh $force
hexsolve liver.hexmesh --example -o liver.toml $force
hexbench -q paper -o paper.md --json paper.json $force
hexbench -q accuracy liver.hexmesh liver.toml --csv accuracy.csv -o accuracy.json $force
# Errors depend on where the lattice lies: eight positions that differ for cells of every size.
rm -f positions.jsonl
while read -r offset; do
  hexmesh -q build liver.nrrd --material '*:young_kpa=100,poisson=0.3,density_kg_m3=1000' --offset "$offset" -o position.hexmesh --force
  for strain in cauchy corotational; do
    for cells in alike condensed graded; do
      case "$cells" in
        alike) keys='grading = "off"' ;;
        condensed) keys='grading = "off"\nstiffness = "condensed"' ;;
        graded) keys='grading = "scene"' ;;
      esac
      sed "s/^strain = .*/strain = \"$strain\"\n$keys/" liver.toml >position.toml
      hexbench -q estimates position.hexmesh position.toml --least-cells 30 -o position.json --force
      echo "{\"offset\": [$offset], \"strain\": \"$strain\", \"cells\": \"$cells\", \"found\": $(tr -d '\n' <position.json)}" >>positions.jsonl
    done
  done
done <"$here/positions.txt"
rm position.*
hexbench -q effects liver.hexmesh "$here/../examples/probe.toml" --level 0 --repeats 1 -o effects.json $force
hexscan -q phantom liver --spacing 4 -o coarse.nrrd $force
hexmesh -q build coarse.nrrd --material '*:young_kpa=100,poisson=0.3,density_kg_m3=1000' -o coarse.hexmesh $force
hexbench -q motion coarse.hexmesh "$here/../examples/held.toml" --level 1 -o motion.json $force
hexsolve -q liver.hexmesh liver.toml --level 2 -o volume.hexresult $force
for light in "" --flat; do
  for run in 1 2 3 4 5; do hexslice volume volume.hexresult --scan ct.nrrd $light -o volume.png --force; done
done 2>volume.txt || { cat volume.txt >&2; exit 1; }
rm volume.png volume.hexresult
"$here/reading.sh" liver.hexmesh liver.toml >reading.csv
"$python" "$here/accuracy/tables.py" . >tables.md
"$python" "$here/accuracy/plot.py" .
cat tables.md paper.md
echo "pictures and all numbers are in $folder" >&2
