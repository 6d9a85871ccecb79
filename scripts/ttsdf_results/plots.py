"""Pictures of the pages."""

import json
import pathlib
import subprocess

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import poses  # noqa: E402
from .logs import SUCCESS_DISTANCE, condense, in_order, of_method, perturbation, perturbations  # noqa: E402

DOTS_PER_INCH = 80
FAMILIES = (("ours", "-", "Oranges_r"), ("TT-", "--", "Blues_r"), ("SDF", "-.", "Purples_r"), ("TSDF", "-.", "Purples_r"),
            ("", ":", "Greens_r"))
MARKERS = "osD^vP"  # of the members of a family: shades alone do not tell them apart
ERROR_RANGE = (0.1, 3000.0)  # [mm], [mrad]: beyond, nothing can be told


def styles(methods):
    """A colour and a line per family, shades within it; ours thick."""
    result, members = {}, {}
    for method in methods:
        prefix, line, colours = next(f for f in FAMILIES if method.startswith(f[0]))
        n = members[colours] = members.get(colours, -1) + 1
        result[method] = {"color": plt.get_cmap(colours)(0.05 + 0.11 * min(n, 5)), "linestyle": line, "marker": MARKERS[n % len(MARKERS)],
                          "linewidth": 2.4 if method == "ours_r40" else 1.3, "zorder": 3 if prefix == "ours" else 2}
    return result


def save(figure, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def errors(title, rows, path):
    """The paper's figure: both errors with quartiles, and success, over the magnitude of both perturbations."""
    rows = [row for row in rows if row["method"] not in ("ours_global", "FGR", "RANSAC")]
    methods = in_order(row["method"] for row in rows)
    style = styles(methods)
    kinds = (("translation", "m"), ("rotation", "rad"))
    figure, grid = plt.subplots(3, 2, figsize=(11, 10), sharex="col")
    for column, (kind, unit) in enumerate(kinds):
        magnitudes = [m for k, m in perturbations(rows) if k == kind]
        for index, method in enumerate(methods):
            cells = [condense([r for r in of_method(rows, method) if perturbation(r) == (kind, m)]) for m in magnitudes]
            places = np.arange(len(magnitudes)) + 0.6 * (index - (len(methods) - 1) / 2) / len(methods)
            for axes, error in zip(grid[:2, column], ("translation_of_all", "rotation_of_all")):
                values = np.clip(1e3 * np.array([getattr(cell, error) for cell in cells]), *ERROR_RANGE)
                axes.errorbar(places, values[:, 1], yerr=(values[:, 1] - values[:, 0], values[:, 2] - values[:, 1]),
                              markersize=4, capsize=2, label=method, **style[method])
            grid[2, column].plot(range(len(magnitudes)), [100 * cell.success for cell in cells], markersize=4,
                                 label=method, **style[method])
        for axes in grid[:, column]:
            axes.grid(True, which="both", alpha=0.25)
        for axes in grid[:2, column]:
            axes.set_yscale("log")
        grid[0, column].set_title(f"{kind} perturbation")
        grid[2, column].set_xticks(range(len(magnitudes)), [f"{m:g}" for m in magnitudes])
        grid[2, column].set_xlabel(f"magnitude [{unit}]")
        grid[2, column].set_ylim(-3, 103)
    grid[0, 0].set_ylabel("translation error [mm]")
    grid[1, 0].set_ylabel("rotation error [mrad]")
    grid[2, 0].set_ylabel(f"success (< {1e3 * SUCCESS_DISTANCE:g} mm) [%]")
    figure.suptitle(f"{title}\nmedian and quartiles over all runs, failures included")
    handles, labels = grid[2, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=6, frameon=False, handlelength=3.5)
    figure.tight_layout(rect=(0, 0.02 + 0.02 * ((len(labels) + 5) // 6), 1, 1))
    save(figure, path)


def map_sizes(maps, path):
    """File size and error over the rank, errors over the size."""
    figure, axes = plt.subplots(1, 3, figsize=(16, 4.5))
    for encoding, colour in (("float32", "tab:blue"), ("float16", "tab:green"), ("quantized", "tab:orange")):
        chosen = sorted((m for m in maps if m["encoding"] == encoding), key=lambda m: m["file_bytes"])
        style = {"marker": "o", "color": colour, "label": encoding}
        kilobytes = [m["file_bytes"] / 1e3 for m in chosen]
        axes[0].plot([m["rank1"] for m in sorted(chosen, key=lambda m: m["rank1"])],
                     [m["file_bytes"] / 1e3 for m in sorted(chosen, key=lambda m: m["rank1"])], **style)
        axes[1].plot(kilobytes, [1e3 * m["surface_rms"] for m in chosen], **style)
        axes[2].plot(kilobytes, [1e3 * m["translation"] for m in chosen], **style)
    labels = (("rank", "file [kB]"), ("file [kB]", "rms within 3 cm of the surface [mm]"),
              ("file [kB]", "median translation error of tracking [mm]"))
    axes[0].set_yscale("log")
    for one, (x, y) in zip(axes, labels):
        one.set_xlabel(x)
        one.set_ylabel(y)
        one.grid(True, which="both", alpha=0.25)
        one.legend()
    for one in axes[1:]:
        one.set_xscale("log")
    figure.tight_layout()
    save(figure, path)


def slice_values(tools, map_file, origin, axes, shape, step):
    """Values of a map on a plane, NaN where it knows nothing, asked of ttsdf_query."""
    u, v = np.meshgrid(np.arange(shape[0]) * step, np.arange(shape[1]) * step, indexing="ij")
    points = origin + u[..., None] * axes[0] + v[..., None] * axes[1]
    text = "\n".join("%.4f %.4f %.4f" % tuple(p) for p in points.reshape(-1, 3)) + "\n"
    answer = subprocess.run([str(tools / "ttsdf_query"), str(map_file), "--points", "-"], input=text, stdout=subprocess.PIPE,
                            universal_newlines=True, check=True).stdout
    table = np.array([[float(word) for word in line.split()] for line in answer.splitlines()])
    return np.where(table[:, 4] > 0, table[:, 0], np.nan).reshape(shape)


def map_slice(tools, compressed, full, path, step=0.01):
    """The same horizontal slice of the compressed map and of the field before compression, and their difference."""
    info = json.loads(subprocess.run([str(tools / "ttsdf_info"), str(compressed), "--json"], stdout=subprocess.PIPE,
                                     universal_newlines=True, check=True).stdout)
    extent = np.array(info["dims"]) * info["voxel_size"]
    R = poses.rotation_from_quaternion(info["rotation_xyzw"])  # of the grid in the map
    short = int(np.argmin(extent))
    long_axes = [R[:, k] for k in range(3) if k != short]
    start = np.array(info["origin"]) + 0.5 * extent[short] * R[:, short]
    shape = [int(extent[k] / step) for k in range(3) if k != short]
    values = [slice_values(tools, file, start, long_axes, shape, step) for file in (compressed, full)]
    figure, axes = plt.subplots(3, 1, figsize=(10, 12))
    titles = (f"compressed: {pathlib.Path(compressed).stat().st_size / 1e3:.1f} kB", f"before compression: {dense_text(info)}",
              "difference")
    for one, title, image, limit in zip(axes, titles, (*values, values[0] - values[1]), (0.2, 0.2, 0.03)):
        drawn = one.imshow(1e3 * image.T, origin="lower", cmap="RdBu", vmin=-1e3 * limit, vmax=1e3 * limit, aspect="equal",
                           extent=(0, shape[0] * step, 0, shape[1] * step))
        if one is not axes[2]:
            one.contour(np.arange(shape[0]) * step, np.arange(shape[1]) * step, image.T, levels=[0.0], colors="k", linewidths=0.8)
        one.set_facecolor("0.85")
        one.set_title(title)
        figure.colorbar(drawn, ax=one, label="signed distance [mm]", shrink=0.8)
    figure.tight_layout()
    save(figure, path)


def dense_text(info):
    return f"{np.prod(np.array(info['dims'], dtype=float)) * 4 / 1e6:.1f} MB as an array"
