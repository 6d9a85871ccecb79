"""Registration without a prior, in places that leave directions open, and what an iteration costs.

usage: scripts/results registration [--data FOLDER] [--quick] [--page FOLDER] [--store FOLDER] [--jobs N]
                                    [--benchmarks FOLDER]

  --data FOLDER        folder with redkitchen/ (default $TTSDF_TEST_DATA); without it only the simulated scenes are used
  --quick              a few scans: shows that everything works
  --page FOLDER        where registration.md goes (default: STORE/page)
  --benchmarks FOLDER  with iteration_benchmark of a build with benchmarks: also the cost of an iteration
"""

import argparse
import csv
import json
import os
import pathlib
import re
import subprocess

from . import facts, protocol, scenes
from .evaluate import Runner, parts_failed
from .logs import condense, read_log, succeeded
from .store import OUT, Step, Store, tools_folder
from .text import markdown, millis, percent

PLACES = ("redkitchen", "apartment")
DEGENERATE = {"corridor": 1, "single_wall": 3, "floor": 3}  # world -> directions without information


class Questions:
    """Steps that ask where scans are, without a prior."""

    def __init__(self, data, scans, slow_scans):
        self.builders = {s.name: protocol.SceneProtocol(s, data, protocol.Plan(scans=scans)) for s in
                         scenes.available(data, PLACES)[0]}
        self.maps = {name: b.build("r40", "--max-rank", 40) for name, b in self.builders.items()}
        self.asked = {}
        for place in self.builders:
            for scans_of, builder in self.builders.items():
                if scans_of == place and builder.scene.down:
                    self.asked[place, scans_of, "known to 0.1 rad"] = self.ask(place, builder, scans, True)
                self.asked[place, scans_of, "unknown"] = self.ask(place, builder, slow_scans, False)

    def ask(self, place, builder, scans, gravity):
        every, offset = builder.scene.scan_selection(scans)
        hint = [f"--map-down={builder.scene.down}", "--gravity-sigma", 0.1] if gravity else []
        return Step(f"{place}/global-{builder.scene.name}-{'gravity' if gravity else 'unaided'}",
                    ["ttsdf_evaluate", "--map", (self.maps[place], "/" + protocol.MAP), "--frames", builder.frames, "--every",
                     every, "--offset", offset, "--depth-scale", builder.scene.depth_scale, "--translations", "0.05",
                     "--rotations", "none", "--directions", 1, "--quiet", "--output", OUT + "/" + protocol.LOG, "--methods",
                     "global", *hint], ("sweep", "register"))


def global_section(store, questions):
    lines, figures = [], {}
    for (place, scans_of, gravity), step in questions.asked.items():
        rows = read_log(store.path(step) / protocol.LOG)
        own = place == scans_of
        wrong = sum(row["accepted"] and not (own and succeeded(row)) for row in rows)
        accepted = sum(row["accepted"] for row in rows)
        cell = condense(rows)
        seconds = sorted(row["ms"] / 1e3 for row in rows)
        lines.append([place, scans_of, gravity, len(rows), percent(cell.success, 1) if own else "", wrong, len(rows) - accepted,
                      f"{cell.milliseconds / 1e3:.2f}", f"{seconds[len(seconds) // 2]:.2f} ({seconds[-1]:.2f})"])
        figures[f"{place} {scans_of} {gravity}"] = {"scans": len(rows), "success": cell.success if own else None, "wrong": wrong,
                                                    "refused": len(rows) - accepted, "cpu_seconds": cell.milliseconds / 1e3}
    return "\n\n".join([
        "## Without a prior", "Scans outside the map. In a map of another place every accepted answer is wrong.",
        markdown(["map", "scans of", "gravity", "scans", "within 5 cm [%]", "accepted and wrong", "refused",
                  "processor time, all threads, median [s]", "wall clock, median (largest) [s]"], lines)]), figures


def degenerate_steps(world):
    frames = Step(f"{world}/frames", ["ttsdf_simulate", "--scene", world, "--output", OUT + "/frames", "--frames", 40,
                                      "--sensor", "kinect"], ("simulate",), makes="frames")
    built = Step(f"{world}/map", ["ttsdf_build", "--frames", (frames, "/frames"), "--every", 2, "--output",
                                  OUT + "/" + protocol.MAP, "--report", OUT + "/report.json"], ("build",))
    batch = Step(f"{world}/batch", ["@frames_to_batch", (frames, "/frames"), OUT + "/batch", "--every", 2, "--offset", 1],
                 makes="batch")
    return Step(f"{world}/register", ["ttsdf_register", "--map", (built, "/" + protocol.MAP), "--batch",
                                      (batch, "/batch/list.txt"), "--output", OUT + "/register.csv", "--uncertainty",
                                      OUT + "/uncertainty.csv"], ("register",))


def reported_directions(folder):
    """Number of directions without information per scan, from either of the files that may have it."""
    for name in ("register.csv", "uncertainty.csv"):
        with (folder / name).open() as file:
            for column in ("degenerate_directions", "weak_directions"):
                file.seek(0)
                reader = csv.DictReader(file)
                if column in reader.fieldnames:
                    return [int(float(row[column] or 0)) for row in reader]
    raise OSError(f"{folder}: got no column of degenerate directions")


def degenerate_section(store, steps):
    lines = []
    for world, step in steps.items():
        counts = reported_directions(store.path(step))
        with (store.path(step) / "register.csv").open() as file:
            answered = [row for row in csv.DictReader(file) if row["success"] == "1"]
        errors = sorted(float(row["translation_error"]) for row in answered)
        right = sum(count >= DEGENERATE[world] for count in counts)
        lines.append([world, DEGENERATE[world], f"{right} of {len(counts)}",
                      ", ".join(f"{n}: {counts.count(n)}" for n in sorted(set(counts))),
                      f"{len(answered)}, {millis(errors[len(errors) // 2])} mm" if errors else "0"])
    return "\n\n".join([
        "## Directions that a scan says nothing about",
        "Simulated worlds that leave some open, Kinect noise, priors 5 cm and 0.03 rad off: the answer keeps the prior along them.",
        markdown(["world", "open directions", "at least as many reported", "number reported: scans",
                  "answers accepted, median error"], lines)])


def cost_section(folder):
    text = subprocess.run([str(pathlib.Path(folder) / "iteration_benchmark"), "--benchmark_format=json",
                           "--benchmark_min_time=0.05"], stdout=subprocess.PIPE, universal_newlines=True, check=True).stdout
    found = {re.split("/(?:iterations|repeats):", b["run_name"])[0]: b for b in json.loads(text)["benchmarks"]}
    cells = [(name.rpartition(":")[2], b["s_per_point_and_iteration"]) for name, b in found.items()
             if name.startswith("overRank/")]
    cells.append(("not compressed", found["dense"]["s_per_point_and_iteration"]))
    return "\n\n".join(["## Cost of an iteration",
                        "Transform, field, residuals, normal equations and step over all points of a scan, warm caches "
                        "(`iteration_benchmark`).",
                        markdown(["rank", *(rank for rank, _ in cells)],
                                 [["ns per point and iteration", *(f"{1e9 * s:.1f}" for _, s in cells)]])])


@parts_failed("registration")
def main(arguments):
    parser = argparse.ArgumentParser(prog="results registration", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"), help=argparse.SUPPRESS)
    parser.add_argument("--quick", action="store_true", help=argparse.SUPPRESS)
    for name in ("--page", "--store", "--benchmarks"):
        parser.add_argument(name, type=pathlib.Path, help=argparse.SUPPRESS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help=argparse.SUPPRESS)
    a = parser.parse_args(arguments)
    build, tools = tools_folder("ttsdf_evaluate", "ttsdf_build", "ttsdf_register", "ttsdf_simulate")
    store = Store((a.store or build / "evaluation").resolve(), tools)
    questions = Questions(a.data, *((5, 2) if a.quick else (100, 20)))
    degenerate = {world: degenerate_steps(world) for world in DEGENERATE}
    chains = [protocol.in_order([step]) for step in (*questions.asked.values(), *degenerate.values())]
    for _ in Runner(store, max(1, a.jobs)).run(chains):
        pass
    run_facts = facts.of_run("scripts/results registration --data DATA" + (" --quick" if a.quick else ""), ("build", "register"))
    section, figures = global_section(store, questions)
    parts = ["# Registration", facts.sentence(run_facts),
             "From a prior, beside other methods: [results](README.md).", section, degenerate_section(store, degenerate)]
    if a.benchmarks:
        parts.append(cost_section(a.benchmarks))
    print(facts.write(a.page or store.folder / "page", "registration", "\n\n".join(parts), run_facts, figures))
    return 0
