#!/usr/bin/env bash
# The displacement-driven liver experiment of Nesme, Faure and Payan (2010), on the bundled phantom or on any scan:
# three places on the surface held, a fourth pulled by 40 mm, coarse to fine.
set -euo pipefail
. "$(dirname "$0")/common.sh"

usage() {
  cat <<'TEXT'
usage: liver.sh [options] -o FOLDER
  --scan FILE       label volume of any organ (default: the bundled liver phantom)
  --segment S       which segment of the scan: NAME, LABEL or LABEL=NAME (default: all)
  --ct FILE         grey values for the pictures (default: the phantom's, or a grid for a scan without)
  --scene FILE      scene instead of the example one, which picks its places from the organ's extremes
  --levels "3 2 1"  mechanical levels, coarse to fine (default: 3 2 1)
  --young KPA       Young's modulus (default: 3, a healthy liver's)
  --poisson "0.45"  Poisson's ratios (default: 0.45)
  --paper           the paper's E = 100 kPa, nu = 0.3 and 0.4
  --points          hold and pull single points as in the paper instead of patches of 10 mm
  --force           replace files that exist
TEXT
}

scan='' segment=() ct='' scene='' levels='3 2 1' young=3 poissons='0.45' radius='' force=() out=''
while [ $# -gt 0 ]; do
  case $1 in
    --scan | --segment | --ct | --scene | --levels | --young | --poisson | -o)
      [ $# -gt 1 ] || { echo "liver.sh: $1 needs a value" >&2; usage >&2; exit 2; }
      case $1 in
        --scan) scan=$(file_name "$2") ;;
        --segment) segment=("--segment=$2") ;;
        --ct) ct=$(file_name "$2") ;;
        --scene) scene=$(file_name "$2") ;;
        --levels) levels=$2 ;;
        --young) young=$2 ;;
        --poisson) poissons=$2 ;;
        -o) out=$(file_name "$2") ;;
      esac
      shift ;;
    --paper) young=100 poissons='0.3 0.4' ;;
    --points) radius=0 ;;
    --force) force=(--force) ;;
    -h | --help) usage; exit 0 ;;
    *) echo "liver.sh: unknown option '$1'" >&2; usage >&2; exit 2 ;;
  esac
  shift
done
[ -n "$out" ] || { usage >&2; exit 2; }
# The scan is read twice, and each scene several times: by the pipe at the end too.
for file in "$scan" "$ct" "$scene"; do
  [ -z "$file" ] || [ -f "$file" ] || [ -d "$file" ] ||
    { echo "liver.sh: '$file' is no file or folder, expected one that can be read again" >&2; exit 3; }
done
mkdir -p "$out"

read_scan() { # writes the labelled volume to "$1"; further words go to hexscan
  if [ -n "$scan" ]; then
    hexscan "$scan" "${segment[@]}" --largest-component "${force[@]}" -o "$@"
  else
    hexscan phantom liver --spacing 2 "${force[@]}" -o "$@"
  fi
}

if [ -z "$scan$ct" ]; then
  ct=$out/ct.nrrd
  read_scan "$out/labels.nrrd" --intensity-out "$ct"
else
  read_scan "$out/labels.nrrd"
fi

table=$out/summary.txt
printf '%-5s %-6s %8s %8s %8s %7s %9s %14s %10s\n' nu level cells dofs seconds Newton residual 'energy [N mm]' 'pull [N]' >"$table"
settings=()
if [ -n "$radius" ]; then
  for which in fix.0 fix.1 fix.2 displace.0; do settings+=(--set "$which.radius_mm=$radius"); done
fi
for nu in $poissons; do
  material=(--material "*:young_kpa=$young,poisson=$nu")
  lattice=$out/nu$nu.hexmesh
  hexmesh build "$out/labels.nrrd" "${material[@]}" "${force[@]}" -o "$lattice"
  if [ -z "$scene" ]; then
    scene=$out/scene.toml
    hexsolve "$lattice" --example "${force[@]}" -o "$scene"
  fi
  for level in $levels; do
    name=$out/nu$nu-level$level
    hexsolve "$lattice" "$scene" --level "$level" "${settings[@]}" "${force[@]}" --report "$name.json" -o "$name.hexresult"
    hexexport -q "$name.hexresult" --lattice "$name.vtu" --surface "$name.vtp" "${force[@]}"
    python3 - "$name.json" "$nu" >>"$table" <<'TEXT'
import json, sys
r = json.load(open(sys.argv[1]))
pull = sum(c * c for c in r["conditions"][-1]["reaction_n"]) ** 0.5
print(f'{sys.argv[2]:<5} {r["lattice"]["level"]:<6} {r["lattice"]["cells"]:>8} {r["lattice"]["dofs"]:>8} '
      f'{r["seconds"]["total"]:>8.2f} {r["newton_iterations"]:>7} {r["relative_residual"]:>9.1e} '
      f'{r["strain_energy_n_mm"]:>14.4f} {pull:>10.4f}')
TEXT
  done
  hexslice planes "$name.hexresult" ${ct:+--scan "$ct"} "${force[@]}" -o "$out/pictures-nu$nu"
  hexslice volume "$name.hexresult" ${ct:+--scan "$ct"} --view oblique "${force[@]}" -o "$out/pictures-nu$nu/volume.png"
  hexexport -q "$name.hexresult" ${ct:+--scan "$ct"} --html "$out/report-nu$nu.html" "${force[@]}"
done

# The same once more as one pipe, nothing written in between.
nu=${poissons%% *} level=${levels%% *}
read_scan - 2>/dev/null | hexmesh -q build - --material "*:young_kpa=$young,poisson=$nu" -o - |
  hexsolve -q - "$scene" --level "$level" "${settings[@]}" -o - | hexexport - --lattice "$out/pipe.vtu" "${force[@]}"

cat "$table"
echo "pictures: $(ls -d "$out"/pictures-nu* | tr '\n' ' ')"
echo "reports: $(ls "$out"/report-nu*.html | tr '\n' ' ')"
echo "ParaView: $(ls "$out"/*.vtu "$out"/*.vtp | tr '\n' ' ')"
