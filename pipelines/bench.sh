#!/usr/bin/env bash
# What accuracy and effects cost, on the phantom: every level against the finest, then one effect after the other.
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

printf '\n'
hexbench effects "$folder/liver.hexmesh" "$(dirname "$0")/../examples/probe.toml" --level 0 --repeats 1 -q -o "$folder/effects.json"
python3 - "$folder" <<'TEXT'
import json, sys
rows = json.load(open(f"{sys.argv[1]}/effects.json"))["effects"]
print(f'{"effect added":<24}{"time over linear":>17}{"memory [MB]":>13}{"Newton":>8}{"changes by, mean [mm]":>23}{"at most":>9}')
for r in rows:
    change = r.get("change_mm", {"mean": 0, "max": 0})
    print(f'{r["effect"]:<24}{r["time_over_linear"]:>17.1f}{r["memory_mb"]:>13.0f}{r["newton_iterations"]:>8}'
          f'{change["mean"]:>23.2f}{change["max"]:>9.2f}')
TEXT

printf '\n'
hexscan -q phantom liver --spacing 4 -o "$folder/coarse.nrrd"
hexmesh -q build "$folder/coarse.nrrd" --material '*:young_kpa=100,poisson=0.3,density_kg_m3=1000' -o "$folder/coarse.hexmesh"
hexbench motion "$folder/coarse.hexmesh" "$(dirname "$0")/../examples/held.toml" --level 1 --threads 1 -q -o "$folder/motion.json"
python3 - "$folder" <<'TEXT'
import json, sys
bench = json.load(open(f"{sys.argv[1]}/motion.json"))
print(f'one thread, peak {bench["peak_gflops_of_a_thread"]:.0f} GFLOP/s; 10 conjugate gradient iterations a step')
print(f'{"nodes":<8}{"cells":>8}{"steps/s":>10}{"229 points":>12}{"1455":>10}{"5541":>10}')
for l in bench["levels"]:
    print(f'{l["nodes"]:<8}{l["cells"]:>8}{l["steps_per_second"]:>10.1f}' + "".join(
        f'{s["steps_per_second"]:>{12 if n == 0 else 10}.1f}' for n, s in enumerate(l["surfaces"])))
plain = next(s["ms_per_step"] for s in bench["solvers"] if s["solver"] == "cg" and s["iterations"] == 10)
print(f'\n{"solver":<12}{"iterations":>12}{"time over cg 10":>17}{"off the converged motion":>26}')
for s in bench["solvers"]:
    print(f'{s["solver"]:<12}{s["iterations"] or "converged":>12}{s["ms_per_step"] / plain:>17.2f}{s["relative_difference"]:>26.1g}')
TEXT
