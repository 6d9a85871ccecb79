"""The plot of what an iteration costs."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import registration_data as data  # noqa: E402
from evaluation_plots import save  # noqa: E402

COST = "s_per_point_and_iteration"


def against(benchmarks, family, counter):
    """[(counter, ns)] of a family, by a counter of its entries."""
    return sorted((x, 1e9 * y) for (_, x), (_, y) in zip(data.series(benchmarks, family, counter),
                                                          data.series(benchmarks, family, COST)))


def draw(axes, points, label, style):
    axes.plot([x for x, _ in points], [y for _, y in points], style, label=label)


def plot_cost(benchmarks, path):
    figure, (points, rank, size) = plt.subplots(1, 3, figsize=(13, 4), sharey=True)
    draw(points, against(benchmarks, "overPoints", "points"), "compressed, R=40", "o-")
    draw(points, against(benchmarks, "denseOverPoints", "points"), "not compressed", "s--")
    draw(rank, [(n, 1e9 * s) for n, s in data.series(benchmarks, "overRank", COST)], "compressed", "o-")
    rank.axhline(1e9 * benchmarks["dense"][COST], linestyle="--", color="tab:orange", label="not compressed")
    draw(size, against(benchmarks, "overMapSize/compressed", "voxels"), "compressed, R=40", "o-")
    draw(size, against(benchmarks, "overMapSize/dense", "voxels"), "not compressed", "s--")
    for axes, label in ((points, "points of the scan"), (rank, "largest TT-rank"), (size, "voxels of the map")):
        axes.set_xlabel(label)
        axes.axhline(60, linewidth=0.8, color="grey")
        axes.grid(True, alpha=0.25)
        axes.legend(frameon=False)
    points.set_xscale("log")
    size.set_xscale("log")
    points.set_ylim(bottom=0)
    points.set_ylabel("ns per point and iteration, all included")
    figure.tight_layout()
    save(figure, path)
