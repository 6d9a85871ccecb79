"""doc/results/README.md: ours and other methods on every scene; doc/results/limits.md: where ours is not ahead."""

from . import elsewhere, plots
from . import facts as facts_of
from .logs import succeeded
from .scenes import SCENES
from .text import bold, known, markdown, millis, percent, size

OURS = "ours_r40"
CONFIDENCES = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)
COLUMNS = ("ours_r40", "ours_r60", "GICP", "ICP_plane", "ICP", "NDT", "TT-SDF")
METHODS = """
| row | what it is |
|---|---|
| ours_r40, ours_r60 | this package: map of rank 40 or 60 (quantized), one scan from the prior, options as they come |
| ours_full | the same field as an array that was never compressed: what compression costs or gains |
| ours_search | ours from many starts around the prior; ours_global: no prior, gravity known to 0.1 rad |
| TT-SDF | the paper's TT-SDF2PC: the distance transform of the voxels at the zero crossings of the fused distance, without a \
sign, plain TT-SVD of rank 70 (what its memory table implies), 32-bit cores, nearest voxel, central differences, \
Gauss-Newton without weights until two steps in a row are below 0.1 mm and 0.1 mrad, at most 50 iterations (it ends there: the pose goes round within a voxel). Success and errors are those of the decompressed \
cores, which has the same values; time and memory those of cores and derivative cores, nothing decoded. Time†: the median of only \
one to three runs (about two scans, one start each, 0.1 m off); all other times are medians of all runs |
| TT-SDF_signed, TT-SDF_negative | other readings of "isocontours from TSDF as occupancy grid": with the sign of the fused \
distance; all voxels behind a surface as occupied |
| TT-TSDF | the paper's truncated variant; where nothing was observed the truncation with the nearest observed sign |
| SDF, TSDF | the paper's fields, not compressed |
| ICP, ICP_plane | Open3D on the paper's point cloud map (cells of 5 cm; 2 cm on the table top), pairs within 1 m, until \
fitness and rms change by less than 1e-7, at most 200 iterations |
| GICP, NDT | PCL on the same cloud; GICP: 20 neighbours, pairs within 1 m, at most 200 iterations; NDT: cells of 0.5 m |
| GICP_small, ICP_plane_small | the same on the finest cloud that Draco packs (12 bits a coordinate) into the bytes of ours_r40 |
| FGR, RANSAC | Open3D, FPFH features, no prior, not refined, as in the paper |
| TEASER++, MSSVConv, Deep Multiview | not run: no Debian package |

The settings of ICP, ICP_plane, GICP and NDT are the best that were found on the red kitchen, and were then used on all scenes (only
the table top's cloud is finer). Nobody has looked for better ones on the other scenes, where these methods might do better with
settings of their own. The defaults of this package are one set for all scenes, too, but they were developed while looking
at results on these scenes.
"""
NOTES = """
Success: within 5 cm of the recorded pose. *Wrong*: the method accepts its answer and it is not within 5 cm. The paper's method and
the point cloud methods have no test of their answer beyond convergence. *d² < 16.8*: share of the accepted answers whose
squared Mahalanobis distance from the recorded pose lies below the 99 % quantile; a right covariance has 99 %.
The recorded poses of the red kitchen are good to about 24 mm and 26 mrad (two methods' trajectories differ by that), so
differences of medians below that say nothing there; the simulated scenes have exact poses.
"""
TUNED = """
The settings of GICP, ICP and NDT were chosen on the red kitchen only and used on all scenes ([methods](#methods)). Scans lie beside
frames of the map: in 12 of the 15 scenes at most five frames away (0.17 s at 30 Hz), in the same sequence
([below](#scans-beside-the-map)). A row of one or two scans says little, bold or not.
"""
HELD_OUT = """
No scan is a frame of the map, but both are from one sequence: scans lie between frames of the map, in six scenes five frames away,
which is 0.17 s at 30 Hz, in six others one or two. In the red kitchen the next frame of the map is 36 mm and 43 mrad away
(median), in the flat 181 mm and 221 mrad, in the building, at two frames, 259 mm and 216 mrad. So the map has seen the same objects
from nearly the same place, which makes all methods look better than on a sequence of another day. The harder scenes are redkitchen_sparse (50 frames; 308 mm and 177 mrad) and apartment_2 (20 frames; 809 mm and 594 mrad).
"""


def parts_of(figures):
    """method -> its figures, over the sweeps that start at a prior."""
    merged = {}
    for name, part in figures["parts"].items():
        if name not in ("ours_global", "without_prior"):
            merged.update(part)
    return merged


def pair(cell, translation="translation", rotation="rotation"):
    if not known(cell[translation][1]):
        return "-"
    return f"{millis(cell[translation][1])} / {millis(cell[rotation][1])}"


def summary_table(scenes):
    """A line per scene: success and wrong answers within reach (0.5 m, 0.25 rad)."""
    rows = []
    for name, figures in scenes.items():
        methods = parts_of(figures)
        row = [f"[{name}](#{name})", figures["what"], figures["scans"]]
        best = max(m["reach"]["success"] for m in methods.values())
        for method in COLUMNS:
            cell = methods[method]["reach"] if method in methods else None
            row.append("" if cell is None else bold(percent(cell["success"], 1), cell["success"] >= best) +
                       f" ({percent(cell['accepted_wrong'], 1)})")
        rows.append(row)
    return markdown(["scene", "", "scans", *COLUMNS], rows)


def median_table(scenes):
    rows = []
    for name, figures in scenes.items():
        methods = parts_of(figures)
        rows.append([name, *(pair(methods[m]["reach"]) if m in methods else "" for m in COLUMNS),
                     " / ".join(percent(methods[m]["reach"]["consistent"]) for m in ("ours_r40", "ours_r60"))])
    return markdown(["scene", *COLUMNS, "ours: d² < 16.8 [%], rank 40 / 60"], rows)


def milliseconds(method, row):
    """† where the time is that of few runs (protocol.CORES)."""
    return f"{row['all']['milliseconds']:.3g}" + ("†" if method.startswith("TT-") else "")


def frames_to_map(name):
    """How many frames the scans of a scene are from the next frame of its map, or None."""
    scene = next((s for s in SCENES if s.name == name), None)
    if scene is None:
        return None
    every, apart = scene.mapped[0], scene.scans[1] - scene.mapped[1]
    return min(apart % every, -apart % every)


def quartile_text(values):
    return f"{millis(values[1])} ({millis(values[0])}-{millis(values[2])})" if known(values[1]) else "-"


def scene_section(name, figures, picture):
    methods = parts_of(figures)
    heads = [f"{magnitude:g} {'m' if kind == 'translation' else 'rad'}" for kind, magnitude, _ in methods[OURS]["success"]]
    success, errors = [], []
    for method, row in methods.items():
        cell, mark = row["all"], method == OURS
        success.append([bold(method, mark), *(percent(s) for _, _, s in row["success"]), percent(cell["accepted_wrong"], 1)])
        errors.append([bold(method, mark), quartile_text(cell["translation"]), millis(cell["rotation"][1]),
                       f"{pair(cell, 'translation_of_all', 'rotation_of_all')}",
                       percent(cell["consistent"]), f"{cell['mahalanobis']:.1f}" if known(cell["mahalanobis"]) else "-",
                       milliseconds(method, row), file_bytes(method, figures), size(row.get("paper_bytes")),
                       size(row.get("memory_bytes"))])
    runs = max(row["all"]["runs"] for row in methods.values())
    agreement = figures["maps"].get("r40", {}).get("frame_agreement_m")
    agree = "" if agreement is None else (f" The frames of the map agree to {millis(agreement)} mm and "
                                          f"{millis(figures['maps']['r40']['frame_agreement_rad'])} mrad.")
    apart = frames_to_map(name)
    beside = f" The next frame of the map is {apart} frame{'s' * (apart > 1)} away from a scan." if apart else ""
    parts = [f"## {name}", f"{figures['what']}; {figures['scans']} scans, {runs} runs per method.{beside}{agree}"]
    if picture:
        parts.append(f"![errors and success over the perturbation]({picture})")
    parts += ["Success [%] by perturbation, and wrong answers accepted [%]:", markdown(["method", *heads, "wrong"], success),
              "Errors over all perturbations:",
              markdown(["method", "translation of successes: median (quartiles) [mm]", "rotation [mrad]", "of all runs [mm / mrad]",
                        "d² < 16.8 [%]", "median d²", "ms", "map file", "the paper's formula", "in memory, measured"], errors)]
    alone = {**figures["parts"].get("ours_global", {}), **figures["parts"].get("without_prior", {})}
    if alone:
        parts += ["Without a prior, one answer per scan:", markdown(
            ["method", "scans", "success [%]", "wrong [%]", "median of successes [mm / mrad]", "processor time [ms]"],
            [[m, r["all"]["runs"], percent(r["all"]["success"]), percent(r["all"]["accepted_wrong"], 1), pair(r["all"]),
              f"{r['all']['milliseconds']:.3g}"] for m, r in alone.items()])]
    return "\n\n".join(parts)


def file_bytes(method, figures):
    names = {"ours_r40": "r40", "ours_r60": "r60", "ours_search": "r40", "TT-SDF": "tt-SDF", "TT-TSDF": "tt-TSDF",
             "TT-SDF_signed": "tt-SDF_signed", "TT-SDF_negative": "tt-SDF_negative", "GICP_small": "r40",
             "ICP_plane_small": "r40"}
    made = figures["maps"].get(names.get(method, "none"))
    return size(made["file_bytes"]) if made else "-"


def reliability_section(rows):
    """How often ours is right where it says how sure it is, over all scenes."""
    said = [r for part in rows.values() for r in part if r["method"] in ("ours_r40", "ours_r60") and known(r["confidence"])]
    if not said:
        return ""
    lines = []
    for low, high in zip(CONFIDENCES, CONFIDENCES[1:]):
        inside = [r for r in said if low <= r["confidence"] < high or high == 1.0 and r["confidence"] == 1.0]
        if inside:
            lines.append([f"{low:g} to {high:g}", len(inside), percent(sum(map(succeeded, inside)) / len(inside), 1)])
    return ("## Confidence\n\nAll scenes and perturbations, ours at both ranks: a calibrated confidence is right as often as it "
            "says.\n\n" + markdown(["confidence", "answers", "within 5 cm [%]"], lines))


def page_text(facts, scenes, pictures, confidence):
    """`scenes`: name -> figures; `pictures`: name -> file, of some scenes; `confidence`: its section."""
    ours = all(frames_to_map(name) for name in scenes)  # not a reader's own frames
    return "\n\n".join([
        "# Results", facts_of.sentence(facts),
        "Where others are ahead: [limits](limits.md). Beside this page, once measured: maps, registration without a prior, trajectories "
        "(`scripts/results --help`).",
        "## All scenes", "Success up to 0.5 m and 0.25 rad [%], in brackets answers that are accepted and wrong [%]:",
        summary_table(scenes), *([TUNED.strip()] if ours else []), "Median of the successes there [mm / mrad]:", median_table(scenes),
        NOTES.strip(),
        *(["## Scans beside the map", HELD_OUT.strip()] if ours else []), confidence, "## Methods", METHODS.strip(),
        *(scene_section(name, figures, pictures.get(name)) for name, figures in scenes.items())]).replace("\n\n\n\n", "\n\n")


def write(folder, facts, scenes, rows):
    """`scenes`: name -> figures; `rows`: name -> rows of the logs. Returns the pages."""
    pictures = {name: f"{name}_errors.png" for name, figures in scenes.items() if len(figures["parts"]) > 3 and folder}
    for name, picture in pictures.items():
        plots.errors(f"{name}: {scenes[name]['what']}", rows[name], facts_of.pathlib.Path(folder) / picture)
    page = facts_of.write(folder, "README", page_text(facts, scenes, pictures, reliability_section(rows)), facts, scenes)
    limits = facts_of.write(folder, "limits", limits_text(facts, scenes), facts, {})
    return page, limits


def behind(name, figures):
    """Lines (scene, figure, ours, best other) where ours at rank 40 is behind on a scene."""
    methods = parts_of(figures)
    ours = methods[OURS]["reach"]
    others = {m: row["reach"] for m, row in methods.items() if not m.startswith("ours")}
    if not others:
        return
    best = max(others, key=lambda m: others[m]["success"])
    if others[best]["success"] > ours["success"] + 1e-9:
        yield [name, "success [%]", percent(ours["success"], 1), f"{best} {percent(others[best]['success'], 1)}"]
    for error, unit in (("translation", "mm"), ("rotation", "mrad")):
        reliable = {m: c for m, c in others.items() if c["success"] >= 0.5 and known(c[error][1])}
        if not reliable or not known(ours[error][1]):
            continue
        best = min(reliable, key=lambda m: reliable[m][error][1])
        if ours[error][1] > 1.05 * reliable[best][error][1]:
            yield [name, f"median {error} [{unit}]", millis(ours[error][1]), f"{best} {millis(reliable[best][error][1])}"]
    times = {m: c["milliseconds"] for m, c in others.items()}
    fastest = min(times, key=times.get)
    if times[fastest] < ours["milliseconds"]:
        yield [name, "time per scan [ms]", f"{ours['milliseconds']:.2g}", f"{fastest} {times[fastest]:.2g}"]
    memory = {m: row["memory_bytes"] for m, row in methods.items() if not m.startswith("ours") and row.get("memory_bytes")}
    mine = methods[OURS].get("memory_bytes")
    if memory and mine:
        least = min(memory, key=memory.get)
        if memory[least] < mine:
            yield [name, "map in memory", size(mine), f"{least} {size(memory[least])}"]


def untrusted(scenes):
    """Scenes whose covariance or acceptance is worse than promised."""
    for name, figures in scenes.items():
        for method in ("ours_r40", "ours_r60"):
            cell = parts_of(figures)[method]["reach"]
            if cell["accepted_wrong"] > elsewhere.WRONG or (known(cell["consistent"]) and cell["consistent"] < 0.95):
                yield [name, method, percent(cell["accepted_wrong"], 1), percent(cell["consistent"])]


LIMITS = """
- **Poses better than the map's.** A map is no better than the poses of the frames that it is made of. Where frames disagree by
  a centimetre or two, so do answers.
- **Places that were never mapped.** Points beyond the mapped surfaces are left out. With less than a fifth of the scan in
  mapped space there is no answer.
- **Long corridors, single walls, floors.** The directions that a scan says nothing about are named, and the pose keeps the prior
  along them. Another sensor has to help.
- **Changing places.** Furniture that moved is an outlier of the kernel, up to about half of the scan. The map is not updated
  while localizing.
- **Thin things.** Two surfaces nearer to each other than twice the truncation (12 cm by default) blend in fusion.
- **Outdoors and long range.** Depth cameras indoors are what was measured. Lidar, sunlight and kilometres were not.
- **Building a map costs time and memory**: seconds to minutes on two cores. A point cloud is ready at once, is edited with any
  tool, and can be updated point by point. Draco, OctoMap or OpenVDB files are read by many programs, this map by this package.
- **Colour and texture** are not used: a flat wall with a poster is a flat wall.
- **No loop closure, no SLAM.** The poses of the mapping run come from elsewhere.
"""


def limits_text(facts, scenes):
    rows = [line for name, figures in scenes.items() for line in behind(name, figures)]
    doubt = list(untrusted(scenes))
    parts = ["# What this is not better at", facts_of.sentence(facts),
             "## Where another method is ahead",
             "Up to 0.5 m and 0.25 rad; medians of methods that succeed at least every second time, and only when they are "
             "ahead by more than 5 %.",
             markdown(["scene", "figure", "ours (rank 40)", "best other"], rows) if rows else "Nowhere on these scenes.",
             "## Where its own word is not good enough",
             "Scenes with more than 1 % of the answers accepted and wrong, or with less than 95 % of the accepted answers "
             "consistent with their covariance.",
             markdown(["scene", "map", "accepted and wrong [%]", "d² < 16.8 [%]"], doubt) if doubt else "None of these scenes.",
             *elsewhere.covariance(scenes, parts_of), "## On other pages", "\n".join(elsewhere.failures()),
             "## What the comparison does not show", "\n".join(elsewhere.caveats(scenes)),
             "## What it does not do", LIMITS.strip()]
    return "\n\n".join(parts)
