"""How estimates compare with true errors, from the lines that measure.py prints; Markdown.

usage: table.py SCENES.jsonl
"""
import json
import statistics
import sys

# Errors below this part of the mean displacement, the largest reaction or the strain energy are of no use to anybody. Reactions that balance the
# load are exact on every level.
NEGLIGIBLE = {"mean_mm": (1e-4, "mean_displacement_mm"), "max_mm": (1e-4, "mean_displacement_mm"),
              "reactions_n": (1e-3, "largest_reaction_n"), "strain_energy_n_mm": (1e-4, "strain_energy_n_mm")}


def ratios(rows, key):
    """Estimate over error of levels: numbers, and how often it is unknown."""
    known, unknown = [], 0
    part, whole = NEGLIGIBLE[key]
    for row in rows:
        for level in row.get("levels", []):
            for e in level[key] if isinstance(level[key], list) else [level[key]]:
                if not level["converged"] or e["error"] < part * row[whole]:
                    continue
                if e["estimate"] is None:
                    unknown += 1
                else:
                    known.append(e["estimate"] / e["error"])
    return known, unknown


def line(name, rows, key):
    known, unknown = ratios(rows, key)
    if not known:
        return
    within = [100 * sum(1 / f <= r <= f for r in known) / len(known) for f in (2, 3)]
    print(f"| {name} | {len(rows)} | {len(known)} | {unknown} | {statistics.median(known):.2f} | {min(known):.2g} to {max(known):.2g} | "
          f"{within[0]:.0f} % | {within[1]:.0f} % | {sum(r < 1 / 3 for r in known)} |")


def equations(rows):
    """What solve.tolerance = "auto" leaves of the equations beside the errors of the cells."""
    parts, parts_of_reactions, estimates = [], [], []
    negligible_mm, _ = NEGLIGIBLE["mean_mm"]
    negligible_part, _ = NEGLIGIBLE["reactions_n"]
    for row in rows:
        for level in row["levels"]:
            left = level.get("equations_mm")
            if not left or level["mean_mm"]["error"] < negligible_mm * row["mean_displacement_mm"]:
                continue
            parts.append(left["error"] / level["mean_mm"]["error"])
            force = max((r["error"] for r in level["reactions_n"]), default=0)
            if force > negligible_part * row["largest_reaction_n"]:  # else they follow from balance
                parts_of_reactions.append(max(left["reactions_n"]) / force)
            if left["estimate"] and left["error"] > 0:
                estimates.append(left["estimate"] / left["error"])
    if not parts:
        return
    print("| error of the equations | levels | median | 95 % | largest | above 0.1 |")
    print("|---|---|---|---|---|---|")
    for name, values in (("over the true mean error of the cells", parts), ("largest of reactions, likewise", parts_of_reactions)):
        if not values:
            continue
        values.sort()
        print(f"| {name} | {len(values)} | {statistics.median(values):.2g} | {values[int(0.95 * (len(values) - 1))]:.2g} | {values[-1]:.2g} | "
              f"{sum(v > 0.1 for v in values)} |")
    if estimates:
        print(f"\nIt is estimated at {min(estimates):.2g} to {max(estimates):.2g} times what it is, median {statistics.median(estimates):.2g}.")
    print()


def main():
    rows = [json.loads(l) for l in open(sys.argv[1])]
    done = [r for r in rows if "levels" in r]
    print(f"{len(done)} of {len(rows)} scenes; estimate over true error, of levels of at least 100 cells that converged\n")
    for title, key in (("mean displacement", "mean_mm"), ("largest displacement", "max_mm"), ("reactions", "reactions_n"),
                       ("strain energy", "strain_energy_n_mm")):
        print(f"| {title} | scenes | levels | unknown | median | range | within 2 | within 3 | below 1/3 |")
        print("|---|---|---|---|---|---|---|---|---|")
        line("all", done, key)
        if key == "mean_mm":
            for what in ("load", "body", "law", "poisson"):
                for value in dict.fromkeys(r[what] for r in done):
                    line(f"{what}: {value}", [r for r in done if r[what] == value], key)
        print()
    equations(done)
    print("| accuracy | asked | kept within 1.2 | told to be missed | broken |")
    print("|---|---|---|---|---|")
    asked = [(r["name"], a) for r in done for a in r["accuracies"]]
    missed = [a for _, a in asked if a["missed"] or not a["converged"]]
    broken = [(n, a) for n, a in asked if not a["missed"] and a["converged"] and a["mean_mm"]["error"] > 1.2 * a["asked_mm"]]
    print(f"| all | {len(asked)} | {len(asked) - len(missed) - len(broken)} | {len(missed)} | {len(broken)} |")
    for name, a in broken:
        print(f"\n{name}: {a['asked_mm']:.3g} mm asked, level {a['level']} of {a['cells']} cells is {a['mean_mm']['error']:.3g} mm off")
    for r in rows:
        if "failed" in r:
            print(f"\n{r['name']}: {r['failed']}")


main()
