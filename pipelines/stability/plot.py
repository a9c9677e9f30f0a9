"""The table of the hard cases (Markdown, on standard output) and one picture of each family, from their records.

usage: plot.py FOLDER      reads FOLDER/records.*.jsonl, writes FOLDER/NN-family.png
"""
import json
import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.collections import LineCollection  # noqa: E402

plt.rcParams.update({"font.size": 8, "axes.grid": True, "grid.alpha": 0.3})
LINES = [dict(color=c, linestyle=s) for s in ("-", "--", ":") for c in ("#000000", "#1f4e8c", "#c0504d", "#8fb34f", "#777777")]


def read(folder):
    records = [json.loads(line) for path in sorted(folder.glob("records.*.jsonl")) for line in path.read_text().splitlines()]
    return sorted(records, key=lambda r: r["family"])


def families(records):
    return {name: [r for r in records if r["family"] == name] for name in dict.fromkeys(r["family"] for r in records)}


def shown(value):
    return f"{value:.3g}" if isinstance(value, (int, float)) else str(value)


def table(records):
    print("| family | case | figure | measured | limit | |")
    print("|---|---|---|---|---|---|")
    for r in records:
        for f in r["figures"]:
            limit = f"{'≤' if f['relation'] == '<=' else '≥'} {shown(f['limit'])}" if "limit" in f else ""
            verdict = {True: "holds", False: "**MISSED**", None: "told"}[f.get("holds")]
            words = [r["family"], r["case"], f["what"], shown(f["measured"]), limit, verdict]
            print("| " + " | ".join(w.replace("|", "/") for w in words) + " |")
    for r in (r for r in records if r["failed"]):
        print(f"| {r['family']} | {r['case']} | its other conditions | | | **FAILED** |")
    limited = [f for r in records for f in r["figures"] if "limit" in f]
    print(f"\n{sum(f['holds'] for f in limited)} of {len(limited)} figures hold.")


def use_of_limit(f):
    """Which part of what is allowed was used; 1 = at the limit."""
    measured, limit = f["measured"], f["limit"]
    if not isinstance(measured, (int, float)):
        return math.inf
    if f["relation"] == "<=":
        return max(measured, 0) / limit if limit > 0 else (0 if measured <= limit else math.inf)
    return limit / measured if measured > 0 else math.inf


def draw_limits(axes, records):
    """A bar for every figure: how much of what is allowed it uses."""
    figures = [(r["case"], f) for r in records for f in r["figures"] if "limit" in f]
    least = 1e-12
    parts = [min(max(use_of_limit(f), least), 10) for _, f in figures]
    axes.barh(range(len(parts)), [p - least for p in parts], left=least, height=0.8,
              color=["#1f4e8c" if f["holds"] else "#c0504d" for _, f in figures])
    axes.set_xscale("log")
    axes.set_xlim(least, 30)
    axes.axvline(1, color="#c0504d", linewidth=1.5)
    axes.set_ylim(len(parts) - 0.5, -0.5)
    axes.set_xlabel("part of what is allowed that is used (1 = the limit)")
    starts = [n for n in range(len(figures)) if n == 0 or figures[n][0] != figures[n - 1][0]]
    axes.set_yticks(starts)
    axes.set_yticklabels([figures[n][0][:70] for n in starts], fontsize=6)


def draw_curves(axes, curves):
    first = curves[0]
    for style, c in zip(LINES, curves):
        axes.plot([math.nan if v is None else v for v in c["x"]], [math.nan if v is None else v for v in c["y"]], label=c["label"], linewidth=1.2, **style)
    axes.set_xscale("log" if first["log_x"] else "linear")
    if first["log_y"]:
        axes.set_yscale("log")
        values = [y for c in curves for y in c["y"] if y is not None]
        axes.set_ylim(bottom=max(min(values), 1e-12 * max(values)))
    axes.set_title(first["title"], fontsize=8)
    axes.set_xlabel(first["x_label"])
    axes.set_ylabel(first["y_label"])
    axes.legend(fontsize=6)


def draw_body(axes, body):
    """Edges of cells, seen from aside and above."""
    def project(p):
        return (p[0] + 0.35 * p[1], p[2] + 0.25 * p[1])

    axes.add_collection(LineCollection([[project(p) for p in edge] for edge in body["edges"]], colors="#1f4e8c", linewidths=0.4))
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set_title(body["label"], fontsize=8)
    axes.grid(False)


def draw(name, records, folder):
    titles = {}
    for r in records:
        for c in r["curves"]:
            titles.setdefault(c["title"], []).append(c)
    bodies = [b for r in records for b in r["bodies"]]
    panels = [(draw_curves, c) for c in titles.values()] + [(draw_body, b) for b in bodies]
    columns = 1 if not panels else 3 if len(panels) > 1 else 2
    rows = max(1, math.ceil(len(panels) / max(1, columns - 1)))
    height = max(3.2 * rows, 0.12 * sum("limit" in f for r in records for f in r["figures"]) + 1.2)
    figure = plt.figure(figsize=(5.5 * columns, min(height, 16)))
    grid = figure.add_gridspec(rows, columns)
    draw_limits(figure.add_subplot(grid[:, 0]), records)
    for n, (how, what) in enumerate(panels):
        how(figure.add_subplot(grid[n // (columns - 1), 1 + n % (columns - 1)]), what)
    figure.suptitle(name)
    figure.tight_layout()
    figure.savefig(folder / (name.replace(" ", "-") + ".png"), dpi=110)
    plt.close(figure)


folder = pathlib.Path(sys.argv[1])
all_records = read(folder)
table(all_records)
for family, own in families(all_records).items():
    draw(family, own, folder)
