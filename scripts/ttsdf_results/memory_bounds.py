"""A map at several bounds on its memory: what it takes and what that costs in time, medians over rounds."""

import csv
import json
import pathlib
import statistics
import subprocess

from .store import StepError

BOUNDS = (0, 1.5, 2, 3, 4, 24)  # MB
FIRST = 5  # scans, evenly through the list, each as the first one of a process and then again and again
KEYS = ("map_memory_bytes", "data_added_bytes", "resident_added_bytes", "cores_bytes", "columns_bytes", "bricks_bytes",
        "far_field_bytes", "mask_bytes", "load_seconds", "first_ms", "warm_ms", "first_per_warm", "median_ms", "p99_ms", "success",
        "median_error")


def registered(tools, folder, *arguments, report=True):
    """Rows and report of one run of ttsdf_register."""
    out, figures = folder / "out.csv", folder / "report.json"
    extra = ["--report", str(figures)] if report else []
    result = subprocess.run([str(tools / "ttsdf_register"), *map(str, arguments), "--output", str(out), *extra],
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True)
    if result.returncode != 0:
        raise StepError("ttsdf_register: " + (result.stderr.strip().splitlines() or ["failed"])[-1])
    with out.open() as file:
        return list(csv.DictReader(file)), json.loads(figures.read_text()) if report else {}


def some_entries(scans, count):
    """Lines of the list, evenly through it, with names that hold in any folder."""
    lines = [line.split() for line in pathlib.Path(scans).read_text().splitlines() if line.strip() and line[0] != "#"]
    folder = pathlib.Path(scans).resolve().parent
    chosen = [lines[(2 * n + 1) * len(lines) // (2 * count)] for n in range(count)]
    return [" ".join(word if word == "-" else str(folder / word) for word in line) for line in chosen]


def whole_list(run, scans):
    rows, figures = run(scans)
    times = [float(row["ms"]) for row in rows]
    errors = [float(row["translation_error"]) for row in rows if row["translation_error"]]
    return {**figures, "median_ms": statistics.median(times), "p99_ms": sorted(times)[int(0.99 * len(times))],
            "success": sum(row["success"] in ("1", "true") for row in rows) / len(rows),
            "median_error": statistics.median(errors) if errors else float("nan")}


def first_scans(run, entries, folder):
    """A scan as the first one that the process sees, and the same one again and again."""
    first, warm = [], []
    for n, entry in enumerate(entries):
        batch = folder / f"first-{n}.txt"
        batch.write_text(10 * (entry + "\n"))
        times = [float(row["ms"]) for row in run(batch)[0]]
        first.append(times[0])
        warm.append(statistics.median(times[1:]))
    return {"first_ms": statistics.median(first), "warm_ms": statistics.median(warm),
            "first_per_warm": statistics.median(f / w for f, w in zip(first, warm))}


def table(tools, folder, a):
    """{bound: figures} for `a.map` and `a.scans`; with `a.against` also of the programs in there, with their own defaults. The
    settings take turns, so that all see the same load."""
    def setting(programs, tt_map, *options, report=True):
        return lambda batch: registered(programs, folder, "--map", tt_map, "--mode", "track", *options, "--batch", batch,
                                        report=report)

    runs = {f"{bound:g} MB": setting(tools, a.map, "--memory-megabytes", bound) for bound in BOUNDS}
    if a.against:
        runs["other build"] = setting(pathlib.Path(a.against), a.against_map or a.map, report=False)
    entries = some_entries(a.scans, FIRST)
    found = {name: [] for name in runs}
    for _ in range(a.rounds):
        for name, run in runs.items():
            found[name].append({**whole_list(run, a.scans), **first_scans(run, entries, folder)})
    return {name: {key: statistics.median(figures[key] for figures in rounds) for key in KEYS if key in rounds[0]}
            for name, rounds in found.items()}
