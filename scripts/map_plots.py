"""Pictures of scripts/map_results."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

ENCODINGS = (("float32", "tab:blue"), ("float16", "tab:green"), ("quantized", "tab:orange"))
DOTS_PER_INCH = 80


def of_encoding(maps, encoding):
    """Ours of one encoding, in order of rank."""
    chosen = [m for m in maps if m["encoding"] == encoding and not m["name"].startswith("paper")]
    return sorted(chosen, key=lambda m: m["rank1"])


def finish(axes, x, y, log=True):
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if log:
        axes.set_yscale("log")
    axes.grid(True, which="both", alpha=0.25)
    axes.legend()


def draw_sizes(maps, path):
    """File size and error over the rank, errors over the size."""
    figure, (size, error, trade, track) = plt.subplots(1, 4, figsize=(22, 5))
    for encoding, colour in ENCODINGS:
        chosen = of_encoding(maps, encoding)
        if not chosen:
            continue
        ranks = [m["rank1"] for m in chosen]
        style = {"marker": "o", "color": colour, "label": encoding}
        size.plot(ranks, [m["file_bytes"] / 1e3 for m in chosen], **style)
        error.plot(ranks, [1e3 * m["surface_rms"] for m in chosen], **style)
        by_size = sorted(chosen, key=lambda m: m["file_bytes"])
        kilobytes = [m["file_bytes"] / 1e3 for m in by_size]
        trade.plot(kilobytes, [1e3 * m["surface_rms"] for m in by_size], **style)
        track.plot(kilobytes, [1e3 * m["translation"] for m in by_size], **style)
    size.axhline(3100, color="black", linestyle="--", label="the paper's map")
    size.axhline(320, color="black", linestyle=":", label="sparse point cloud, 5 cm")
    for axes in (trade, track):
        axes.set_xscale("log")
        axes.axvline(320, color="black", linestyle=":", label="sparse point cloud, 5 cm")
    finish(size, "rank", "file [kB]")
    finish(error, "rank", "rms within 3 cm of the surface [mm]", log=False)
    finish(trade, "file [kB]", "rms within 3 cm of the surface [mm]", log=False)
    finish(track, "file [kB]", "median translation error of tracking [mm]", log=False)
    figure.tight_layout()
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def points_of(benchmarks, prefix, value):
    """Argument and value of all benchmarks of a name, e.g. `ttSvdOfACube/64`."""
    points = []
    for name, figure in benchmarks.items():
        words = name.split("/")
        if "/".join(words[:-1]) == prefix and words[-1].isdigit():
            points.append((int(words[-1]), value(name, figure)))
    return np.array(sorted(points)).T


def draw_growth(results, path):
    figure, (svd, evaluation, memory, voxels) = plt.subplots(1, 4, figsize=(22, 5))
    cpu = lambda name, _: results.milliseconds(name, "cpu_time")  # noqa: E731
    sides, times = points_of(results.benchmarks, "ttSvdOfACube", cpu)
    svd.loglog(sides, times, marker="o", label="TT-SVD of a cube, rank 20")
    svd.loglog(sides, times[-1] * (sides / sides[-1]) ** 4, "k--", label="n^4")
    svd.loglog(sides, times[-1] * (sides / sides[-1]) ** 3, "k:", label="n^3")
    finish(svd, "side n [voxel]", "time [ms]")

    per_point = lambda name, figure: 1e9 * figure["s_per_point"]  # noqa: E731
    for prefix, label in (("trainField/trilinear", "later scans"), ("trainFieldCold", "first scan after loading")):
        evaluation.plot(*points_of(results.benchmarks, prefix, per_point), marker="o", label=label)
    dense = 1e9 * results.benchmarks["denseField"]["s_per_point"]
    evaluation.axhline(dense, color="black", linestyle="--", label="uncompressed array")
    finish(evaluation, "rank R", "value and gradient, per point [ns]")

    for encoding, colour in ENCODINGS[:1]:
        chosen = of_encoding(results.maps, encoding)
        memory.plot([m["rank1"] for m in chosen], [m["memory_bytes"] / 1e3 for m in chosen], marker="o", color=colour,
                    label="cores and mask")
        memory.plot([m["rank1"] for m in chosen], [m["localizer_bytes"] / 1e3 for m in chosen], marker="s", color="tab:red",
                    label="localizer: decoded bricks, far field")
        ranks = np.array(sorted(m["rank1"] for m in chosen), dtype=float)
        n1, n2, n3 = sorted(chosen[0]["dims"])[1], min(chosen[0]["dims"]), max(chosen[0]["dims"])
        memory.plot(ranks, 4e-3 * ((n1 + n3) * ranks + n2 * ranks**2), "k--", label="(N1 + N3) R + N2 R^2 floats")
        memory.axhline(chosen[0]["dense_bytes"] / 1e3, color="black", linestyle=":", label="dense array")
    finish(memory, "rank R", "memory [kB]")

    voxel_count = [np.prod(np.array(m["dims"], dtype=float)) for m in results.sizes]
    for figure_name, label in (("dense_bytes", "dense array"), ("memory_bytes", "cores and mask"), ("file_bytes", "file")):
        voxels.plot(voxel_count, [m[figure_name] / 1e3 for m in results.sizes], marker="o", label=label)
    voxels.set_xscale("log")
    finish(voxels, "voxels of the same room, rank 40", "size [kB]")
    figure.tight_layout()
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)
