#!/usr/bin/env bash
# What a level costs and what it changes, on the phantom: every level against the finest one solved.
set -euo pipefail
. "$(dirname "$0")/common.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
hexscan -q phantom liver --spacing 2 -o "$folder/liver.nrrd"
hexmesh -q build "$folder/liver.nrrd" --material '*:young_kpa=100,poisson=0.3' -o "$folder/liver.hexmesh"
hexsolve "$folder/liver.hexmesh" --example -o "$folder/liver.toml"
for level in 0 1 2 3; do
  hexsolve -q "$folder/liver.hexmesh" "$folder/liver.toml" --level $level --report "$folder/$level.json" -o "$folder/$level.hexresult"
done
python3 - "$folder" <<'TEXT'
import json, sys
reports = [json.load(open(f"{sys.argv[1]}/{level}.json")) for level in (3, 2, 1, 0)]
finest = reports[-1]["strain_energy_n_mm"]
error = {l["level"]: l["error_mm"]["mean"] for l in reports[-1]["levels"]}  # as the finer levels tell afterwards
print(f'{"level":<6}{"cells":>8}{"dofs":>9}{"solve [s]":>11}{"Newton":>8}{"linear":>8}{"error [mm]":>12}{"energy over level 0":>21}')
for r in reports:
    print(f'{r["lattice"]["level"]:<6}{r["lattice"]["cells"]:>8}{r["lattice"]["dofs"]:>9}{r["seconds"]["solve"]:>11.2f}'
          f'{r["newton_iterations"]:>8}{r["linear_iterations"]:>8}{error[r["lattice"]["level"]]:>12.2f}'
          f'{r["strain_energy_n_mm"] / finest:>21.4f}')
TEXT
