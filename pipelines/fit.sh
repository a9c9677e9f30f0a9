#!/usr/bin/env bash
# From the shape seen now to the displacement everywhere: two segmentations to a fit with pictures, or twins of the phantom that show how
# good fits are: it is deformed, all but its shape is forgotten, and parts of that are hidden.
set -euo pipefail
. "$(dirname "$0")/common.sh"

usage() {
  cat <<'TEXT'
usage: fit.sh --before FILE --now FILE [--segment S] [--ct FILE] [--young KPA] [--poisson NU] -o FOLDER
       fit.sh --twins [--scan FILE [--segment S]] -o FOLDER
  --before, --now   label volumes of one organ at two times
  --segment S       which segment of both: NAME, LABEL or LABEL=NAME (default: all)
  --ct FILE         grey values of the first, for the pictures
  --twins           a body deformed by a scene that the fit does not know; errors inside over the part that is seen: twins.md
  --scan FILE       the twins' body (default: the phantom)
  --force           replace files that exist
TEXT
}

before='' now='' scan='' ct='' segment=() young=3 poisson=0.45 twins='' force=() out=''
while [ $# -gt 0 ]; do
  case $1 in
    --before | --now | --segment | --ct | --scan | --young | --poisson | -o)
      [ $# -gt 1 ] || { echo "fit.sh: $1 needs a value" >&2; usage >&2; exit 2; }
      case $1 in
        --before) before=$(file_name "$2") ;;
        --now) now=$(file_name "$2") ;;
        --segment) segment=("--segment=$2") ;;
        --ct) ct=$(file_name "$2") ;;
        --scan) scan=$(file_name "$2") ;;
        --young) young=$2 ;;
        --poisson) poisson=$2 ;;
        -o) out=$(file_name "$2") ;;
      esac
      shift ;;
    --twins) twins=yes ;;
    --force) force=(--force) ;;
    -h | --help) usage; exit 0 ;;
    *) echo "fit.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
  esac
  shift
done
[ -n "$out" ] && { [ -n "$twins" ] || { [ -n "$before" ] && [ -n "$now" ]; }; } || { usage >&2; exit 2; }
mkdir -p "$out"

if [ -n "$twins" ]; then
  if [ -n "$scan" ]; then
    hexscan "$scan" "${segment[@]}" --largest-component "${force[@]}" -o "$out/body.nrrd"
  else
    hexscan phantom liver --spacing 3 "${force[@]}" -o "$out/body.nrrd"
  fi
  hexmesh build "$out/body.nrrd" --material "*:young_kpa=$young,poisson=$poisson" "${force[@]}" -o "$out/body.hexmesh"
  python3 "$(dirname "$0")/fit/twins.py" "$out" >"$out/twins.md"
  cat "$out/twins.md"
  exit 0
fi
hexmesh build "$before" "${segment[@]}" --material "*:young_kpa=$young,poisson=$poisson" "${force[@]}" -o "$out/before.hexmesh"
hexfit "$out/before.hexmesh" "$now" "${segment[@]}" --report "$out/fit.json" --write-scene "$out/fit.toml" "${force[@]}" \
  -o "$out/fit.hexresult"
hexslice planes "$out/fit.hexresult" ${ct:+--scan "$ct"} --target "$out/fit.1.hexsurface" "${force[@]}" -o "$out/pictures"
hexexport "$out/fit.hexresult" --html "$out/fit.html" --surface "$out/fit.vtp" --transform-points "$out/before_to_now.h5" "${force[@]}"
