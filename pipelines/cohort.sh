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
  --segment S      which segment of each case that does not say, and its name: NAME, LABEL or LABEL=NAME
  --materials FILE materials of hexmesh build (default: told by the segments' names)
  --level N        mechanical level (default: the finest of at most 20000 cells)
  --processes N    solve each case by hexsolve-mpi with N processes
  --jobs N         steps at once (default: all processors; with --slurm 200)
  --slurm          send the steps to Slurm (pipelines/cohort/slurm/config.yaml)
Start it again after whatever stopped it: what was finished is not done again. Exit code 1 if a case failed, 4 if the run could not be.
TEXT
}

scans='' out='' jobs='' settings=() more=()
while [ $# -gt 0 ]; do
  case $1 in
    -o) out=$(file_name "${2:?-o needs a folder}"); shift ;;
    --scene | --materials) settings+=("${1#--}=$(realpath -e -- "$2")"); shift ;;
    --segment | --level | --processes) settings+=("${1#--}=$2"); shift ;;
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
mkdir -p "$out/logs"
out=$(realpath "$out")
case " ${more[*]} " in
  *" --profile "*) [ -z "$jobs" ] || more+=(--jobs "$jobs") ;;
  *) more+=(--cores "${jobs:-$(nproc)}") ;;
esac

# One run in a folder at a time; the lock is held until the last process of the run has ended. Killed ones take a moment.
exec 9>"$out/.cohort.lock"
flock -w 5 9 || { echo "cohort.sh: another run is at work in '$out'" >&2; exit 4; }
python3 "$here/cohort/cases.py" "$scans" "$out" "${settings[@]}" || exit 3

code=0
snakemake --snakefile "$here/cohort/Snakefile" --directory "$out" --nolock --keep-going --rerun-incomplete \
  --rerun-triggers mtime params input --scheduler greedy --quiet all "${more[@]}" 2>"$out/logs/snakemake.log" || code=$?
failed=0
python3 "$here/cohort/summary.py" "$out" || failed=$?  # 3: some were not begun
if [ "$code" -gt 1 ] || { [ "$code" -eq 1 ] && [ "$failed" -ne 1 ]; }; then
  echo "cohort.sh: snakemake failed, and not for a case: $(grep . "$out/logs/snakemake.log" | tail -n 1 "$out/logs/snakemake.log") ($out/logs/snakemake.log)" >&2
  exit 4
fi
exit "$failed"
