"""Pictures of what accuracy costs, from the JSON files that run.sh leaves in a folder.

usage: plot.py FOLDER      writes NAME.png and NAME.svg beside them
"""
import json
import math
import pathlib
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import tables  # noqa: E402

# Told apart by marker, line and brightness, so that a grey print can be read.
STYLES = {
    "cells": dict(color="#000000", marker="o", linestyle="-", linewidth=2.2),
    "cells, graded": dict(color="#000000", marker="*", linestyle="-", linewidth=1.2, markersize=9),
    "cells, condensed": dict(color="#000000", marker="P", linestyle="--", linewidth=1.2),
    "uniform cells": dict(color="#777777", marker="o", linestyle=":", markerfacecolor="white"),
    "tetrahedra, Cholesky": dict(color="#1f4e8c", marker="s", linestyle="-"),
    "tetrahedra, CG": dict(color="#1f4e8c", marker="s", linestyle="--", markerfacecolor="white"),
    "tetrahedra, graded, Cholesky": dict(color="#c0504d", marker="^", linestyle="-"),
    "tetrahedra, graded, CG": dict(color="#c0504d", marker="^", linestyle="--", markerfacecolor="white"),
    "tetrahedra, QR, CG": dict(color="#8fb34f", marker="D", linestyle="-.", markerfacecolor="white"),
    "tetrahedra, QR": dict(color="#8fb34f", marker="D", linestyle="-."),
    "tetrahedra": dict(color="#1f4e8c", marker="s", linestyle="--"),
}
OTHER = dict(color="#555555", marker="x", linestyle="-.")  # meshes of files
plt.rcParams.update({"font.size": 10, "axes.grid": True, "grid.alpha": 0.3, "svg.hashsalt": "hextools"})


def read(folder, name):
    path = folder / (name + ".json")
    return json.loads(path.read_text()) if path.exists() else None


def save(figure, folder, name):
    figure.tight_layout()
    for ending in ("png", "svg"):
        figure.savefig(folder / f"{name}.{ending}", dpi=130, metadata={"Date": None} if ending == "svg" else None)
    plt.close(figure)


def error_of(row):
    """Cells tend to the voxels, tetrahedra to the smooth surface: each against its own limit."""
    return row.get("to_voxels_mm_mean" if "cells" in row["method"] else "to_tets_mm_mean")


def curves(rows, law, x):
    """(method, points) of the sharpest tolerance, coarse to fine."""
    rows = [r for r in rows if r["law"] == law and r["converged"] and error_of(r)]
    for method in dict.fromkeys([*STYLES, *(r["method"] for r in rows)]):
        own = [r for r in rows if r["method"] == method]
        if not own:
            continue
        sharpest = min(r["tolerance"] for r in own)
        yield method, sorted((r[x], error_of(r)) for r in own if r["tolerance"] == sharpest and error_of(r) > 1e-4)


def pareto(points):
    """Those that nothing else beats in both."""
    front, best = [], float("inf")
    for x, error in sorted(points):
        if error < best:
            front.append((x, error))
            best = error
    return front


def plot_errors(rows, folder, x, label, name, with_front):
    laws = [law for law in ("cauchy", "corotational", "green-lagrange") if any(r["law"] == law for r in rows)]
    figure, axes = plt.subplots(1, len(laws), figsize=(5 * len(laws) + 2, 4.6), sharey=True, squeeze=False)
    for law, axis in zip(laws, axes[0]):
        everything = []
        for method, points in curves(rows, law, x):
            axis.loglog(*zip(*points), label=method, **{"markersize": 5, **STYLES.get(method, OTHER)})
            everything += points
        if with_front and everything:
            front = pareto(everything)
            axis.step(*zip(*front), where="post", color="#000000", alpha=0.18, linewidth=9, label="Pareto front", zorder=0)
        axis.set_title(f'strain = "{law}"')
        axis.set_xlabel(label)
    axes[0][0].set_ylabel("mean distance to the limit of the method [mm]")
    axes[0][-1].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.02, 1))
    save(figure, folder, name)


def plot_motions(rows, folder):
    figure, axes = plt.subplots(1, 2, figsize=(11.2, 4.6))
    for method in STYLES:
        own = sorted((r["nodes"], r["steps_per_second"]) for r in rows if r["method"] == method and r["iterations"] == 10)
        if own:
            axes[0].loglog(*zip(*own), label=method + ", 10 iterations", **{"markersize": 5, **STYLES[method]})
        settled = sorted((r["steps_per_second"], error_of(r)) for r in rows if r["method"] == method and error_of(r))
        if settled:
            axes[1].loglog(*zip(*settled), label=method, **{"markersize": 5, **STYLES[method], "linestyle": ""})
    axes[0].axhline(25, color="#000000", linewidth=0.8)
    axes[0].text(axes[0].get_xlim()[0], 27, " 25 steps/s", fontsize=8)
    axes[0].set_xlabel("nodes")
    axes[0].set_ylabel("steps of 0.02 s per second")
    axes[1].set_xlabel("steps per second (5, 10 and 20 iterations)")
    axes[1].set_ylabel("mean distance to equilibrium after 2 s [mm]")
    for axis in axes:
        axis.legend(fontsize=8)
    save(figure, folder, "steps")


def plot_effects(rows, folder):
    figure, axis = plt.subplots(figsize=(7, 3.2))
    names = [r["effect"] for r in rows]
    times = [r["time_over_linear"] for r in rows]
    axis.barh(names, times, color="#bbbbbb", edgecolor="black")
    for n, (row, time) in enumerate(zip(rows, times)):
        change = row.get("change_mm")
        axis.text(time, n, f' {change["mean"]:.2g} mm' if change else "", va="center", fontsize=8)
    axis.invert_yaxis()
    axis.grid(axis="y", visible=False)
    axis.set_xlim(0, max(times) * 1.15)
    axis.set_xlabel("time over linear elasticity, each effect added to those above\n(beside the bars: what it changes on average)")
    save(figure, folder, "effects")


def plot_table1(rows, folder):
    figure, axis = plt.subplots(figsize=(6.4, 4.4))
    compressions = [0.1, 0.2, 0.3]

    def line(key, column):
        return [next(r[column] for r in rows if r["case"].startswith(f"{100 * c:.0f} %") and key in r["case"]) for c in compressions]

    axis.plot(compressions, line("linear, voxels", "paper"), "s--", color="#c0504d", label="paper: Ansys")
    axis.plot(compressions, line("well fitted, 20 mm, mean", "paper"), "^--", color="#c0504d", label="paper: cells, well fitted")
    axis.plot(compressions, line("badly fitted, 20 mm, mean", "paper"), "v--", color="#c0504d", markerfacecolor="white", label="paper: cells, badly fitted")
    axis.plot(compressions, line("linear, voxels", "reference"), "x-", color="#777777", label="reference: linear")
    axis.plot(compressions, line("linear, voxels", "ours"), "o", color="#777777", markerfacecolor="white", label="ours: linear")
    axis.plot(compressions, line("well fitted, 20 mm, mean", "reference"), "-", color="#000000", label="co-rotational limit")
    axis.plot(compressions, line("well fitted, 20 mm, mean", "ours"), "^", color="#000000", label="ours: 20 mm cells, well fitted")
    axis.plot(compressions, line("badly fitted, 20 mm, mean", "ours"), "v", color="#000000", markerfacecolor="white", label="ours: badly fitted")
    axis.set_xticks(compressions)
    axis.set_xlabel("compression of the cylinder")
    axis.set_ylabel("radius half way (0.5 at rest)")
    axis.legend(fontsize=8)
    save(figure, folder, "table1")


def plot_pairs(rows, folder, name, pairs, label, strip):
    """Bars side by side, one group for each row."""
    figure, axis = plt.subplots(figsize=(8.5, 0.42 * len(rows) + 1.5))
    height = 0.8 / len(pairs)
    for n, (key, legend, face, hatch) in enumerate(pairs):
        axis.barh([i + n * height for i in range(len(rows))], [r.get(key) or 0 for r in rows], height, label=legend,
                  color=face, edgecolor="black", hatch=hatch)
    axis.set_yticks([i + 0.4 - height / 2 for i in range(len(rows))], [strip(r["case"]) for r in rows], fontsize=8)
    axis.invert_yaxis()
    axis.grid(axis="y", visible=False)
    axis.set_xlabel(label)
    axis.legend(fontsize=8)
    save(figure, folder, name)


def plot_convergence(folder):
    """Error over the size of the cells: the pulled liver at eight positions of its lattice, a pressed cylinder."""
    figure, axis = plt.subplots(figsize=(6.4, 4.8))
    errors = tables.of_positions(folder)
    for law, label, style in (("cauchy", "liver pulled, small strain", dict(color="#000000", marker="o")),
                              ("corotational", "liver pulled, co-rotational", dict(color="#000000", marker="o", linestyle="--", markerfacecolor="white"))):
        sizes = [2 * 2 ** level for level in errors]
        middle, low, high = zip(*((statistics.median(e[law]), min(e[law]), max(e[law])) for e in errors.values()))
        axis.errorbar(sizes, middle, [[m - l for m, l in zip(middle, low)], [h - m for m, h in zip(middle, high)]], capsize=3,
                      label=f"{label}: order {order(sizes, middle, 2):.1f}", **style)
    rows = (read(folder, "paper") or {}).get("uniform", [])
    for name, style in (("cylinder, pressed by 10 %", dict(color="#c0504d", marker="^")),
                        ("cylinder, shifted", dict(color="#c0504d", marker="^", linestyle="--", markerfacecolor="white"))):
        own = sorted((float(r["case"].split(", ")[-1].split(" mm")[0]), r["ours"]) for r in rows if r["case"].startswith(name + ","))
        axis.plot(*zip(*own), label=f"{name}: order {order(*zip(*own), 2.5):.1f}", **style)
    axis.set_xscale("log", base=2)
    axis.set_yscale("log")
    axis.set_xlabel("edge of the cells [mm]")
    axis.set_ylabel("mean distance to the voxels' solution [mm]")
    axis.legend(fontsize=8)
    save(figure, folder, "convergence")


def order(sizes, errors, voxel):
    """The p of C (h^p - voxel^p), by least squares of logarithms: errors are held against the voxels' solution."""
    def misfit(p):
        return statistics.pvariance([math.log(e / (h ** p - voxel ** p)) for h, e in zip(sizes, errors)])

    return min((n / 100 for n in range(20, 400)), key=misfit)


def main(folder):
    accuracy = read(folder, "accuracy")
    if accuracy:
        plot_errors(accuracy["equilibria"], folder, "total_s", "seconds from voxels to solution, one thread", "error_time", True)
        plot_errors(accuracy["equilibria"], folder, "dofs", "degrees of freedom", "error_dofs", False)
        if accuracy["motions"]:
            plot_motions(accuracy["motions"], folder)
    if (folder / "positions.jsonl").exists():
        plot_convergence(folder)
    effects = read(folder, "effects")
    if effects:
        plot_effects(effects["effects"], folder)
    paper = read(folder, "paper") or {}
    if "table1" in paper:
        plot_table1(paper["table1"], folder)
    if "fig7" in paper:
        plot_pairs(paper["fig7"], folder, "fig7", [("to_fine_mm", "non-uniform cells", "#444444", ""), ("uniform_to_fine_mm", "averaged cells", "#ffffff", "//")],
                   "mean distance to 2 mm cells [mm]", lambda case: case.split(": ")[0])
    if "table2" in paper:
        plot_pairs(paper["table2"], folder, "table2", [("paper", "paper", "#c0504d", ""), ("ours", "ours, measured as in the paper", "#444444", ""), ("to_limit_mm", "ours, to the limit of the same law", "#ffffff", "//")],
                   "mean distance [mm]", lambda case: case.replace(" [mm]", ""))
    if "uniform" in paper:
        plot_pairs(paper["uniform"], folder, "uniform", [("ours", "non-uniform cells", "#444444", ""), ("uniform", "averaged cells", "#ffffff", "//")],
                   "mean distance to the voxels [mm]", lambda case: case.replace(" [mm]", ""))
    if "table3" in paper:
        figure, axis = plt.subplots(figsize=(6.4, 4.2))
        rows = paper["table3"]
        for points, marker in ((229, "o"), (1455, "s"), (5541, "^")):
            axis.loglog(*zip(*sorted((r["nodes"], r["ours"]) for r in rows if r["points"] == points)), marker + "-", color="black", markerfacecolor="white", label=f"ours, surface of {points} points")
        for points, marker in ((229, "o"), (1455, "s")):
            axis.loglog(*zip(*sorted((r["paper_nodes"], r["paper"]) for r in rows if r["points"] == points and r["paper"])), marker + "--", color="#c0504d", label=f"paper, {points} points")
        axis.set_xlabel("nodes")
        axis.set_ylabel("steps per second, 10 iterations each")
        axis.legend(fontsize=8)
        save(figure, folder, "table3")


main(pathlib.Path(sys.argv[1]))
