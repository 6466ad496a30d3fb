"""The picture of scripts/carve_compare: times and accuracy of carving and meshing, beside others."""
import csv
import json

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen first)
from matplotlib.ticker import FuncFormatter, NullFormatter  # noqa: E402

from carve_anchors import (ACCURACY, CARVING_MS, POINTS, REFERENCE_CUT_AT_LEAST_MS,  # noqa: E402
                           REFERENCE_CUT_MS)

OURS, OURS_WHOLE = "#0060b0", "#7fb2dd"
OTHERS = {"reference, K = ∞ (lossless)": "#8c2d04", "reference, K = 1 (loses cells)": "#e6550d",
          "plain lossless prototype": "#7a7a7a", "reference": "#e6550d",
          "soft visibility, area term": "#2ca25f", "soft visibility, quality term": "#a6761d"}
WINDOW = 25  # keyframes


def read_results(folder):
    """{name: numbers of carve-bench, "events", and "accuracy" where there is one}."""
    results = {}
    for name in POINTS:
        path = folder / f"{name}.json"
        if not path.exists():
            continue
        results[name] = json.loads(path.read_text(encoding="utf-8"))
        for key in ("keyframe_ms_mean", "from_scratch_ms", "cut_ms_incremental_median"):
            if key not in results[name]:
                raise KeyError(f"{path.name} lacks {key}")
        with open(folder / f"{name}.csv", encoding="utf-8") as file:
            results[name]["events"] = list(csv.DictReader(file))
        accuracy = folder / f"{name}.accuracy.json"
        if accuracy.exists():
            results[name]["accuracy"] = json.loads(accuracy.read_text(encoding="utf-8"))
    return results


def thousands(value, _=None):
    return f"{value / 1000:g}k"


def note(axes, text, color="#555555"):
    axes.text(0.98, 0.03, text, transform=axes.transAxes, ha="right", fontsize=8, color=color)


def style(axes, title):
    axes.set_title(title, loc="left", fontsize=10.5, fontweight="bold")
    axes.grid(True, which="major", color="#e4e4e4", linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def points_axis(axes):
    axes.set_xscale("log")
    axes.set_xticks(list(POINTS.values()))
    axes.xaxis.set_major_formatter(FuncFormatter(thousands))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="x", which="minor", length=0)
    axes.set_xlabel("map points")


def milliseconds_axis(axes):
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(
        lambda ms, _: f"{ms:g} ms" if ms < 1000 else f"{ms / 1000:g} s"))


def curve(axes, names, means, highs, color, label, **how):
    """A line through the means with a whisker up to the 95 % quantile."""
    x = [POINTS[name] for name in names]
    axes.plot(x, means, color=color, label=label, marker="o", markersize=4, **how)
    if highs:
        axes.vlines(x, means, highs, color=color, linewidth=1.2, alpha=0.55)
        axes.plot(x, highs, color=color, marker="_", linestyle="none", markersize=7, alpha=0.7)


def draw_carving(axes, results):
    for label, rows in CARVING_MS.items():
        curve(axes, rows, [row[0] for row in rows.values()], [row[1] for row in rows.values()],
              OTHERS[label], label, linewidth=1.4)
    ours = list(results)
    curve(axes, ours, [r["from_scratch_ms"] for r in results.values()], None, OURS_WHOLE,
          "Foresight, whole map anew", linewidth=1.4, linestyle="--")
    curve(axes, ours, [r["keyframe_ms_mean"] for r in results.values()],
          [r["keyframe_ms_p95"] for r in results.values()], OURS, "Foresight (lossless)",
          linewidth=2.6)
    style(axes, "Carving a keyframe")
    note(axes, "mean; whisker: 95 % quantile")
    points_axis(axes)
    milliseconds_axis(axes)
    axes.legend(fontsize=7.5, frameon=False, loc="upper left")
    axes.set_ylim(0.4, 40_000)


def draw_cut(axes, results):
    names = list(REFERENCE_CUT_MS)
    curve(axes, names, list(REFERENCE_CUT_MS.values()), None, OTHERS["reference"],
          "reference (anew each time)", linewidth=1.4)
    for name, ms in REFERENCE_CUT_AT_LEAST_MS.items():
        axes.plot([POINTS[names[-1]], POINTS[name]], [REFERENCE_CUT_MS[names[-1]], ms],
                  color=OTHERS["reference"], linestyle=":", marker="^", markevery=[1])
        axes.annotate(f"> {ms / 1000:g} s", (POINTS[name], ms), (-6, -2), ha="right",
                      textcoords="offset points", fontsize=8, color=OTHERS["reference"])
    ours = list(results)
    curve(axes, ours, [r["cut_ms_from_scratch"] for r in results.values()], None, OURS_WHOLE,
          "Foresight, whole map anew", linewidth=1.4, linestyle="--")
    curve(axes, ours, [r["cut_ms_incremental_median"] for r in results.values()],
          [r["cut_ms_incremental_p95"] for r in results.values()], OURS,
          "Foresight, from delta to mesh", linewidth=2.6)
    style(axes, "From there to the mesh (cut, surface)")
    note(axes, "ours: median; whisker: 95 % quantile")
    points_axis(axes)
    milliseconds_axis(axes)
    axes.legend(fontsize=7.5, frameon=False, loc="upper left")


def windows(events, key):
    """Means over WINDOW keyframes: (points, ms)."""
    keyframes = [event for event in events if event["kind"] == "keyframe"]
    pairs = []
    for begin in range(0, len(keyframes) - len(keyframes) % WINDOW, WINDOW):
        window = keyframes[begin:begin + WINDOW]
        pairs.append((sum(float(e["points"]) for e in window) / WINDOW,
                      sum(float(e[key]) for e in window) / WINDOW))
    return zip(*pairs) if pairs else ((), ())


def draw_growth(axes, results):
    name = list(results)[-1]
    events = results[name]["events"]
    axes.plot([POINTS[n] for n in results], [r["from_scratch_ms"] for r in results.values()],
              color=OURS_WHOLE, linestyle="--", marker="o", markersize=4,
              label="carving the whole map anew")
    axes.plot(*windows(events, "carve_ms"), color=OURS, linewidth=2.6, label="carving a keyframe")
    axes.plot(*windows(events, "cut_ms"), color="#6a3d9a", linewidth=1.8,
              label="its mesh (passes over all cells)")
    new = [float(e["constraints_added"]) for e in events if e["kind"] == "keyframe"]
    note(axes, f"{sum(new) / len(new):.0f} new rays per keyframe on average", OURS)
    style(axes, f"While the map of {name} grows")
    axes.set_xlim(left=0)
    axes.xaxis.set_major_formatter(FuncFormatter(thousands))
    axes.set_xlabel(f"map points so far (means over {WINDOW} keyframes)")
    milliseconds_axis(axes)
    axes.legend(fontsize=7.5, frameon=False, loc="upper left")
    axes.set_ylim(0.4, 40_000)


def draw_accuracy(axes, column, title, results):
    for label, rows in ACCURACY.items():
        axes.plot([POINTS[n] for n in rows], [row[column] for row in rows.values()], marker="o",
                  markersize=4, linewidth=1.4, color=OTHERS[label], label=label)
    ours = {n: r["accuracy"][column] for n, r in results.items() if "accuracy" in r}
    axes.plot([POINTS[n] for n in ours], list(ours.values()), marker="o", markersize=5,
              linewidth=2.6, color=OURS, label="Foresight")
    style(axes, title)
    points_axis(axes)
    if column == 0:
        axes.set_yscale("log")
        axes.set_yticks([1, 2, 5, 10, 20, 50])
        axes.yaxis.set_major_formatter(FuncFormatter(lambda cm, _: f"{cm:g} cm"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.set_ylim(30, 101)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{share:g} %"))


def draw(results, path):
    has_accuracy = any("accuracy" in r for r in results.values())
    figure = plt.figure(figsize=(13.2, 8.4 if has_accuracy else 4.4), dpi=90,
                        constrained_layout=True)
    grid = figure.add_gridspec(2 if has_accuracy else 1, 12,
                               height_ratios=[1.25, 1] if has_accuracy else [1])
    top = [figure.add_subplot(grid[0, 4 * n:4 * n + 4]) for n in range(3)]
    draw_carving(top[0], results)
    draw_cut(top[1], results)
    draw_growth(top[2], results)
    if has_accuracy:
        titles = ("Mean error of the mesh", "Mesh within 5 cm", "Seen surface found, 5 cm",
                  "Depth of unseen views, 5 %")
        for n, title in enumerate(titles):
            axes = figure.add_subplot(grid[1, 3 * n:3 * n + 3])
            draw_accuracy(axes, n, title, results)
            if n == 2:
                axes.legend(fontsize=7.5, frameon=False, loc="lower right")
    figure.savefig(path)
    plt.close(figure)
