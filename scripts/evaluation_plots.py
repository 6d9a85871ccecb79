"""Figures of the perturbation sweep and of the rank sweep."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from evaluation_data import KINDS, SUCCESS_DISTANCE, Sweep, condense, in_order  # noqa: E402

DOTS_PER_INCH = 80
FAMILIES = ((("ours", "ours_search", "ours_not_compressed", "ours_1cm", "ours_global"), "-", "Oranges_r"),
            (("TT-SDF2PC", "TT-TSDF", "SDF2PC", "TSDF2PC"), "--", "Blues_r"))  # the rest: ":", Greens
ERROR_RANGE = (0.1, 3000.0)  # [mm], [mrad]: beyond, nothing can be told


def style(method):
    """A colour and a line per family, ours thick: twelve methods are told apart so."""
    name = method.split(" R")[0]
    for names, line, colours in FAMILIES:
        if name in names:
            shade = names.index(name) / (len(names) + 1)
            return {"color": plt.get_cmap(colours)(0.15 + shade), "linestyle": line, "zorder": 3,
                    "linewidth": 2.4 if name == "ours" else 1.2}
    others = ("ICP", "ICP_plane", "GICP", "NDT")
    shade = others.index(name) / (len(others) + 1) if name in others else 0.5
    return {"color": plt.get_cmap("Greens_r")(0.1 + shade), "linestyle": ":", "linewidth": 1.5}


def draw_errors(axes, sweep, kind, error, shown):
    """Median with quartile bars; the methods stand side by side at every magnitude."""
    magnitudes = sweep.magnitudes(kind)
    for index, method in enumerate(shown):
        cells = [sweep.cell(method, kind, m) for m in magnitudes]
        values = np.array([getattr(c, error) if c else (np.nan,) * 3 for c in cells]) * 1e3
        values = np.clip(values, *ERROR_RANGE)
        positions = np.arange(len(magnitudes)) + 0.6 * (index - (len(shown) - 1) / 2) / len(shown)
        bars = (values[:, 1] - values[:, 0], values[:, 2] - values[:, 1])
        axes.errorbar(positions, values[:, 1], yerr=bars, marker="o", markersize=3, capsize=2, label=method,
                      **style(method))
    axes.set_xticks(range(len(magnitudes)))
    axes.set_xticklabels([f"{m:g}" for m in magnitudes])
    axes.set_yscale("log")
    axes.grid(True, which="both", alpha=0.25)


def draw_success(axes, sweep, kind, shown):
    magnitudes = sweep.magnitudes(kind)
    for method in shown:
        cells = [sweep.cell(method, kind, m) for m in magnitudes]
        axes.plot(range(len(magnitudes)), [100 * c.success if c else np.nan for c in cells], marker="o", markersize=3,
                  label=method, **style(method))
    axes.set_xticks(range(len(magnitudes)))
    axes.set_xticklabels([f"{m:g}" for m in magnitudes])
    axes.set_ylim(-3, 103)
    axes.grid(True, alpha=0.25)


def plot_errors(title, rows, path):
    """The paper's figure: both errors and the success rate over the magnitude of both perturbations."""
    sweep = Sweep(rows)
    kinds = [(kind, unit) for kind, unit in KINDS if sweep.magnitudes(kind)]
    figure, grid = plt.subplots(3, len(kinds), figsize=(5.5 * len(kinds), 10), sharex="col", squeeze=False)
    for column, (kind, unit) in enumerate(kinds):
        shown = [m for m in sweep.methods if m != "prior" and any(sweep.cell(m, kind, x) for x in sweep.magnitudes(kind))]
        draw_errors(grid[0][column], sweep, kind, "translation", shown)
        draw_errors(grid[1][column], sweep, kind, "rotation", shown)
        draw_success(grid[2][column], sweep, kind, shown)
        grid[0][column].set_title(f"{kind} perturbation")
        grid[2][column].set_xlabel(f"magnitude [{unit}]")
    grid[0][0].set_ylabel("translation error [mm]")
    grid[1][0].set_ylabel("rotation error [mrad]")
    grid[2][0].set_ylabel(f"success (< {1e3 * SUCCESS_DISTANCE:g} mm) [%]")
    figure.suptitle(f"{title}: median and quartiles over all runs")
    handles, labels = grid[2][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=4, frameon=False)
    figure.tight_layout(rect=(0, 0.02 + 0.025 * ((len(labels) + 3) // 4), 1, 1))
    save(figure, path)


def plot_times(title, rows, path):
    """A bar per method for the time of a scan."""
    times = Sweep(rows).times
    figure, axes = plt.subplots(figsize=(7, 0.8 + 0.3 * len(times)))
    bars = axes.barh(list(times), list(times.values()))
    for bar, time in zip(bars, times.values()):
        axes.annotate(f" {time:.3g}", (bar.get_width(), bar.get_y() + 0.5 * bar.get_height()), va="center")
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.margins(x=0.15)
    axes.set_xlabel("processor time per scan, median [ms]")
    axes.set_title(title)
    figure.tight_layout()
    save(figure, path)


def split_rank(method):
    """`ours R40` -> (`ours`, 40)."""
    name, rank = method.rsplit(" R", 1)
    return name, int(rank)


def plot_ranks(title, rows, path):
    """The paper's rank figure: errors over the rank, from one magnitude of either perturbation."""
    figure, grid = plt.subplots(1, 2, figsize=(11, 4))
    families = in_order(split_rank(row["method"])[0] for row in rows)
    for axes, error, unit in zip(grid, ("translation", "rotation"), ("mm", "mrad")):
        for family in families:
            ranks = sorted({split_rank(r["method"])[1] for r in rows if split_rank(r["method"])[0] == family})
            cells = [condense([r for r in rows if r["method"] == f"{family} R{rank}"]) for rank in ranks]
            values = 1e3 * np.array([getattr(cell, error) for cell in cells])
            bars = (values[:, 1] - values[:, 0], values[:, 2] - values[:, 1])
            axes.errorbar(ranks, values[:, 1], yerr=bars, marker="o", capsize=2, label=family, **style(family))
        axes.set_xlabel("largest TT-rank")
        axes.set_ylabel(f"{error} error [{unit}]")
        axes.set_yscale("log")
        axes.grid(True, which="both", alpha=0.25)
    grid[0].legend(frameon=False)
    figure.suptitle(f"{title}: median and quartiles over the rank")
    figure.tight_layout()
    save(figure, path)


def save(figure, path):
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)
