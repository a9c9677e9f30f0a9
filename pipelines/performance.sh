#!/usr/bin/env bash
# What the solver reaches of what the machine can do, on the phantom: a table, and performance.csv to compare versions by.
#
# usage: pipelines/performance.sh [-o FOLDER] [--short] [--against OLD.csv]     (FOLDER defaults to performance)
set -euo pipefail
. "$(dirname "$0")/common.sh"
here=$(cd "$(dirname "$0")" && pwd)
folder=performance short= against=
while [ $# -gt 0 ]; do
  case "$1" in
    -o) folder=$(file_name "${2:?-o needs a folder}"); shift 2 ;;
    --short) short=1; shift ;;
    --against) against=$(realpath "${2:?--against needs a performance.csv}"); shift 2 ;;
    *) echo "unknown option '$1', expected -o FOLDER, --short or --against OLD.csv" >&2; exit 2 ;;
  esac
done
mkdir -p "$folder"
cd "$folder"
rm -f machine.json machine.1.json solver.{cauchy,corotational}.*.json solve.{coarse,auto,size}.*.json callgrind.{cauchy,corotational,json} calculix.*

tissue='*:young_kpa=100,poisson=0.3,density_kg_m3=1000'
threads=$(nproc)
export OMP_NUM_THREADS=$threads

# NAME SPACING: the phantom's liver as NAME.hexmesh, and the experiment for it.
make_liver() {
  hexscan -q phantom liver --spacing "$2" -o "$1.nrrd" --force
  hexmesh -q build "$1.nrrd" --material "$tissue" -o "$1.hexmesh" --force --report "$1.build.json"
  hexsolve -q "$1.hexmesh" --example -o "$1.toml" --force
  rm "$1.nrrd"
}

echo "== machine" >&2
hexbench machine -o machine.json
OMP_NUM_THREADS=1 hexbench machine -o machine.1.json

echo "== operator, V-cycle and set-up" >&2
make_liver cells 2
for level in 0 2; do
  for strain in cauchy corotational; do
    sed "s/^strain = .*/strain = \"$strain\"/" cells.toml >"$strain.toml"
    hexbench solver cells.hexmesh "$strain.toml" --level $level --repeats 9 -o "solver.$strain.$level.json"
  done
done

# The experiment from a cold start to the written result: NAME LEVEL TOLERANCE CASE [RUNS]
solve() {
  local run
  for ((run = 0; run < ${5:-1}; ++run)); do
    hexsolve -q "$1.hexmesh" "$1.toml" --level "$2" --set "solve.tolerance=$3" -o "$1.hexresult" --force \
      --report "solve.$4.$run.json"
  done
  rm "$1.hexresult"
}

echo "== coarse levels, one thread" >&2
make_liver coarse 2.2
for level in 3 2 1; do
  OMP_NUM_THREADS=1 solve coarse $level 1e-6 "coarse.$level" 5
done

sizes=("0.13M 2.67 3" "1.0M 1.34 1")
[ -n "$short" ] || sizes+=("4.1M 0.835 1" "7.9M 0.67 1")
for size in "${sizes[@]}"; do
  read -r name spacing runs <<<"$size"
  echo "== $name unknowns" >&2
  make_liver "$name" "$spacing"
  solve "$name" 0 '"auto"' "auto.$name" "$runs"
  solve "$name" 0 1e-6 "size.$name" "$runs"
  rm "$name.hexmesh"
done

# The same cells, with the paper's volume and supports, in CalculiX: NAME SPACING
calculix() {
  local strain mm case start
  make_liver "$1" "$2"
  for strain in cauchy green-lagrange; do
    case="calculix.$1.$strain" mm=28.284271
    [ $strain = cauchy ] || mm=7.071068  # a pull of 10 mm in place of 40
    sed -e "s/^strain = .*/strain = \"cauchy\"/; s/^volumetric = \"mean\"/volumetric = \"full\"/" \
      -e "s/^radius_mm.*/&\non = \"nodes\"/; s/28\.284271/$mm/g" "$1.toml" >"$case.toml"
    hexsolve -q "$1.hexmesh" "$case.toml" --level 0 -o "$case.hexresult" --force --report "$case.json"
    hexexport -q "$case.hexresult" --inp "$case.inp" --force
    if [ $strain != cauchy ]; then
      sed -i -e 's/^\*STEP.*/*STEP, NLGEOM, INC=100/' -e 's/^\*STATIC.*/*STATIC\n1., 1./' "$case.inp"
      sed -i "s/^strain = .*/strain = \"$strain\"/" "$case.toml"
    fi
    hexsolve -q "$1.hexmesh" "$case.toml" --level 0 -o "$case.hexresult" --force --report "$case.json"
    start=$(date +%s.%N)
    ccx "$case" >"$case.log"
    awk -v start="$start" -v end="$(date +%s.%N)" 'BEGIN { printf "{\"seconds\": %.2f}\n", end - start }' >"$case.ccx.json"
    rm "$case".{hexresult,inp,dat,frd,sta,cvg,12d} 2>/dev/null || true
  done
  rm "$1.hexmesh"
}

echo "== CalculiX" >&2
if command -v ccx >/dev/null; then
  calculix 0.04M 4
  [ -n "$short" ] || calculix 0.13M 2.67
else
  echo "no ccx: CalculiX is left out" >&2
fi

echo "== instructions" >&2
if command -v valgrind >/dev/null; then
  for strain in cauchy corotational; do
    OMP_NUM_THREADS=1 valgrind -q --tool=callgrind --callgrind-out-file="callgrind.$strain" \
      hexbench solver cells.hexmesh "$strain.toml" --level 2 --repeats 1 --force -o callgrind.json
  done
fi

python3 "$here/performance/table.py" . ${against:+"$against"} >performance.md
cat performance.md
echo "the table and performance.csv are in $folder" >&2
