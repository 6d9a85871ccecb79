"""The results page: tables, pictures, and where ours is not ahead. Everything on it comes from the logs."""

import datetime
import os
import pathlib
import platform
import subprocess

import evaluation_plots as plots
from evaluation_data import KINDS, SUCCESS_DISTANCE, DataError, Evaluation, Sweep, condense, in_order, methods_in_order
from evaluation_memory import memory_section
from evaluation_verdict import verdict_section

TITLES = {"objects-exact": "objects, exact depth", "objects-kinect": "objects, Kinect noise",
          "apartment": "apartment (simulated, exact poses)", "room": "room (simulated, exact poses)"}

METHODS = """
| row | what it is |
|---|---|
| prior | returns the prior: the floor of the comparison |
| ours | this package's tracking: compressed map, robust registration from the prior |
| ours_search | the same from 64 starts around the prior |
| ours_not_compressed | the same field as an array that was never compressed: what compression costs or gains |
| ours_1cm | on objects: ours with the paper's voxels of 1 cm, rank 40 |
| ours_global | no prior; the direction of gravity is known to 0.1 rad |
| TT-SDF2PC, TT-TSDF | the paper's: plain truncated TT-SVD (rank 70 on scenes, which its memory table implies, 40 on \
objects), 32-bit cores, nearest voxel, Gauss-Newton |
| SDF2PC, TSDF2PC | the paper's fields, not compressed; nearest voxel, Gauss-Newton |
| ICP, ICP_plane, GICP, NDT | PCL, on the paper's point cloud map: cells of 5 cm on scenes, 2 cm on objects |
| FPFH_RANSAC | FPFH and PCL's SampleConsensusPrerejective; no prior |
| FPFH_FGR | FPFH and Fast Global Registration (Zhou, Park, Koltun 2016), written from its paper; no prior |
| TEASER++, MSSVConv, Deep Multiview | not run: code or weights are not packaged. The paper draws their errors without \
numbers; it says that TEASER fails on ModelNet, and that global methods are stable over all magnitudes but less exact \
than local ones. Its memory for both learned maps is 640 kB (5000 features) |

Scenes: every 10th frame is mapped at 2 cm, scans lie half-way between mapped frames, every 8th pixel. Objects: models scaled
to 1 m, mapped from the mesh at 1 cm, ours at 0.5 cm in files of at most 20 kB (ICP's cloud has 22 kB on the smallest models
by the paper's count); five views each, every 4th pixel, visible surface only.
"""


FURTHER = {
    "accuracy.md": "[Where the error comes from](accuracy.md): what is the field's, the compression's and the truth's.",
    "registration.md": "[Registration](registration.md): what it promises, and which promises it keeps."}


class PageError(Exception):
    pass


def command_output(*command, **options):
    try:
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, universal_newlines=True,
                              check=True, **options).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def commit_of(root):
    name = command_output("git", "rev-parse", "--short", "HEAD", cwd=root)
    changed = command_output("git", "status", "--porcelain", "--", "src", "include", "scripts", cwd=root)
    return (name or "unknown") + (" with local changes" if changed else "")


def cpu_name():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown processor"


def facts(root, command):
    """What the page says about the run itself."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    return {"command": command, "date": datetime.date.today().isoformat(),
            "commit": commit_of(root),
            "machine": f"{cpu_name()}, {os.cpu_count()} cores, {memory:.0f} GB",
            "load_before": os.getloadavg()[0]}


def title_of(group):
    return TITLES.get(group, group)


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def bold(text, method):
    return f"**{text}**" if method == "ours" else text


def columns(sweep):
    return [(kind, magnitude, f"{magnitude:g} {unit}") for kind, unit in KINDS for magnitude in sweep.magnitudes(kind)]


def sweep_table(sweep, text_of):
    """One row per method, one column per magnitude."""
    heads = columns(sweep)
    rows = []
    for method in sweep.methods:
        cells = [sweep.cell(method, kind, magnitude) for kind, magnitude, _ in heads]
        rows.append([bold(method, method)] + [bold(text_of(cell), method) if cell else "" for cell in cells])
    return table(["method"] + [head for _, _, head in heads], rows)


def millis(value):
    return f"{1e3 * value:.1f}" if value < 0.1 else f"{1e3 * value:.0f}"


def group_section(group, rows, folder):
    sweep = Sweep(rows)
    runs = max(cell.runs for cell in sweep.cells.values())
    picture = f"{group}_errors.png"
    plots.plot_errors(title_of(group), rows, folder / picture)
    times = table(["method", "ms"], [[bold(m, m), bold(f"{t:.3g}", m)] for m, t in sweep.times.items() if m != "prior"])
    return "\n\n".join([
        f"## On {title_of(group)}",
        f"{sweep.scans} scans, {runs} runs per cell.",
        f"![errors]({picture})",
        f"Success [%]: translation error below {100 * SUCCESS_DISTANCE:g} cm.",
        sweep_table(sweep, lambda cell: f"{100 * cell.success:.0f}"),
        "Median error [mm / mrad] over all runs, failures included.",
        sweep_table(sweep, lambda cell: f"{millis(cell.translation[1])} / {millis(cell.rotation[1])}"),
        "Processor time per scan, median over all runs.", times])


def without_prior_section(evaluation):
    rows = []
    for group, log in evaluation.without_prior.items():
        for method in methods_in_order(log):
            cell = condense([row for row in log if row["method"] == method])
            rows.append([title_of(group), method, str(cell.runs), f"{100 * cell.success:.0f}",
                         f"{millis(cell.translation[1])} ({millis(cell.translation[0])}-{millis(cell.translation[2])})",
                         millis(cell.rotation[1]), f"{cell.milliseconds:.3g}"])
    head = ["data", "method", "scans", "success [%]", "translation [mm], quartiles", "rotation [mrad]", "time [ms]"]
    return ("## Without a prior\n\nOne estimate per scan; to these methods every perturbation is the same. "
            "The FPFH rows are not refined by a local method, as in the paper; where they find no answer they keep the prior, "
            "1000 mm away.\n\n" + table(head, rows))


def rank_section(evaluation, folder):
    parts = ["## Dependence on the TT-rank",
             "From perturbations of 0.1 m and 0.1 rad. Map bytes as in the file."]
    for name, rows in evaluation.ranks.items():
        picture = f"{name}_ranks.png"
        plots.plot_ranks(name, rows, folder / picture)
        lines = []
        for method in in_order(row["method"] for row in rows):
            family, rank = plots.split_rank(method)
            cell = condense([row for row in rows if row["method"] == method])
            stem = "ours" if family == "ours" else "tt_sdf"
            size = evaluation.map_file_bytes(name, f"ranks/{stem}_{rank}")
            lines.append([family, str(rank), f"{size / 1e3:.0f} kB" if size else "", f"{100 * cell.success:.0f}",
                          f"{millis(cell.translation[1])} / {millis(cell.rotation[1])}"])
        lines.sort(key=lambda line: (line[0] != "ours", int(line[1])))
        parts += [f"![ranks]({picture})",
                  table([name, "rank", "map file", "success [%]", "median [mm / mrad]"], lines)]
    return "\n\n".join(parts)


def run_section(run):
    load = ""
    if "load_before" in run:
        load = f" Load of the machine at the start {run['load_before']:.1f}"
        load += f", at the end {run['load_after']:.1f}." if "load_after" in run else "; the run was interrupted."
    return (f"Made by `{run.get('command', 'scripts/evaluate')}`, commit {run.get('commit', 'unknown')}, "
            f"{run.get('date', 'date unknown')}, on {run.get('machine', 'an unknown machine')}.{load} "
            "Times are processor times. Tables and pictures are made from the logs.")


def write(output, folder):
    """Writes README.md and its pictures into `folder`; returns the page's path."""
    try:
        evaluation = Evaluation(output)
    except DataError as error:
        raise PageError(str(error)) from error
    if not evaluation.local:
        raise PageError(f"{output}: got no logs of a sweep, wanted fields_*.csv or clouds_*.csv of some data set")
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    parts = ["# Results", run_section(evaluation.run_facts()), verdict_section(evaluation, title_of, table),
             *(text for page, text in FURTHER.items() if (folder / page).exists()),
             "## Methods\n" + METHODS.rstrip()]
    parts += [group_section(group, rows, folder) for group, rows in evaluation.local.items()]
    if evaluation.without_prior:
        parts.append(without_prior_section(evaluation))
    if evaluation.ranks:
        parts.append(rank_section(evaluation, folder))
    parts.append(memory_section(evaluation, table))
    page = folder / "README.md"
    page.write_text("\n\n".join(parts) + "\n")
    return page
