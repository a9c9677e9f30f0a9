#!/usr/bin/env bash
# Many scans: each from its segmentation to a solved lattice, pictures and a report, by Snakemake; then one table of all.
set -euo pipefail
. "$(dirname "$0")/common.sh"
here=$(cd "$(dirname "$0")" && pwd)

usage() {
  cat <<'TEXT'
usage: cohort.sh SCANS -o FOLDER [options] [-- SNAKEMAKE OPTIONS]
  SCANS            a table of cases (.tsv, see pipelines/cohort/README.md), or a folder: each file or subfolder is a case
  --scene FILE     scene for all cases without one of their own (default: the example one, from the organ's extremes)
  --materials FILE materials of hexmesh build (default: told by the segments' names)
  --level N        mechanical level (default: the finest of at most 20000 cells)
  --solver CMD     in place of hexsolve, e.g. "mpiexec -n 4 hexsolve-mpi"
  --jobs N         cases at once (default: all processors)
  --slurm          send the steps to Slurm (pipelines/cohort/slurm/config.yaml)
Start it again after whatever stopped it: what was finished is not done again. Exit code 1 if a case failed.
TEXT
}

scans='' out='' scene='' materials='' level='' solver=hexsolve jobs=$(nproc) more=()
while [ $# -gt 0 ]; do
  case $1 in
    -o) out=${2:?-o needs a folder}; shift ;;
    --scene) scene=$(realpath -e "$2"); shift ;;
    --materials) materials=$(realpath -e "$2"); shift ;;
    --level) level=$2; shift ;;
    --solver) solver=$2; shift ;;
    --jobs) jobs=$2; shift ;;
    --slurm) more+=(--profile "$here/cohort/slurm") ;;
    -h | --help) usage; exit 0 ;;
    --) shift; more+=("$@"); break ;;
    -*) echo "cohort.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
    *) [ -z "$scans" ] || { echo "cohort.sh: one folder or table, got '$scans' and '$1'" >&2; exit 2; }; scans=$1 ;;
  esac
  shift
done
[ -n "$scans" ] && [ -n "$out" ] || { usage >&2; exit 2; }
command -v snakemake >/dev/null || { echo "cohort.sh: no snakemake, expected Debian's package snakemake" >&2; exit 1; }
[ -e "$scans" ] || { echo "cohort.sh: no such file or folder '$scans'" >&2; exit 3; }
mkdir -p "$out"
out=$(realpath "$out") scans=$(realpath "$scans")

# One run in a folder at a time; the lock ends with its holder, so that what a killed run left locked can be unlocked.
exec 9>"$out/.cohort.lock"
flock -n 9 || { echo "cohort.sh: another run is at work in '$out'" >&2; exit 1; }
python3 "$here/cohort/cases.py" "$scans" >"$out/cases.json.new" || exit 3
mv "$out/cases.json.new" "$out/cases.json"

settings=(scene="$scene" materials="$materials" level="$level" solver="$solver")
run=(snakemake --snakefile "$here/cohort/Snakefile" --directory "$out" --config "${settings[@]}")
"${run[@]}" --unlock --quiet all --cores 1 9>&- 2>/dev/null || true
"${run[@]}" --cores "$jobs" --jobs "$jobs" --keep-going --rerun-incomplete --rerun-triggers mtime params input --nolock --quiet all \
  "${more[@]}" 9>&- 2>"$out/snakemake.log" || true
python3 "$here/cohort/summary.py" "$out"
