"""Runs the protocol over the scenes at hand and prints scene x method x {success, accepted but wrong, median, consistency}.

usage: scripts/evaluate [--quick] [--data FOLDER] [--scenes NAMES] [--frames FOLDER] [--ours SETTINGS] [--no-clouds]
                        [--failures] [--list] [--page FOLDER] [--store FOLDER] [--jobs N]

  --data FOLDER    folder with the public sequences (default $TTSDF_TEST_DATA); scenes that are not there are left out
  --scenes NAMES   only these, with commas between
  --frames FOLDER  a folder of your own (7-Scenes layout) instead of the scenes
  --quick          few scenes, scans and perturbations: shows that everything works, in under three minutes
  --ours SETTINGS  key=value,... options of our registration, to try them out: restarts=0,kernel_scale_end=0.03
  --no-clouds      without the point cloud methods
  --failures       also lists every run of ours that failed, or is accepted and wrong
  --page FOLDER    writes the results pages there (doc/results); red kitchen and apartment are then swept as in the paper:
                   all its magnitudes, five directions, every method
  --list           shows the scenes that are at hand, and runs nothing
  --store FOLDER   maps and logs (default <build folder>/evaluation). What is there for this code is not run again:
                   an interrupted call goes on, and several builds can share one store
  --jobs N         steps at a time (default: one per core; times are processor times)

Columns: success: within 5 cm of the truth, per perturbation [%]. wrong: accepted by the method but not within 5 cm [%].
median: translation [mm] / rotation [mrad] of the successes, then of all runs. d2 < 16.8: share of the accepted runs whose
squared Mahalanobis distance from the truth is below the 99 % quantile, and the median of that distance (5.3 is ideal).
"""

import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import sys
import time

from . import comparison_page, facts, figures, protocol, scenes
from .logs import LogError, condense, in_order, of_method, perturbation, perturbations, succeeded
from .store import Store, StepError, tools_folder
from .text import aligned, millis, percent


def table_line(method, rows, columns):
    cell = condense(rows)
    by_magnitude = [percent(condense([r for r in rows if perturbation(r) == p]).success) for p in columns]
    return [method, str(cell.runs), " ".join(f"{text:>3}" for text in by_magnitude), percent(cell.accepted_wrong, 1),
            f"{millis(cell.translation[1])} / {millis(cell.rotation[1])}",
            f"{millis(cell.translation_of_all[1])} / {millis(cell.rotation_of_all[1])}",
            f"{percent(cell.consistent)} {cell.mahalanobis:.1f}" if cell.consistent == cell.consistent else "-",
            f"{cell.milliseconds:.1f}"]


def scene_table(rows):
    columns = perturbations(rows)
    head = " ".join(f"{m:g}" for kind, m in columns if kind == "translation") + " m, " + \
           " ".join(f"{m:g}" for kind, m in columns if kind == "rotation") + " rad"
    lines = [["method", "runs", f"success at {head}", "wrong %", "median mm/mrad", "of all", "d2 < 16.8", "ms"]]
    return aligned(lines + [table_line(m, of_method(rows, m), columns) for m in in_order(r["method"] for r in rows)])


def failures(rows):
    for row in rows:
        if row["method"].startswith("ours") and not succeeded(row):
            yield (f"  {row['method']} {row['scan']} {row['kind']} {row['magnitude']:g} direction {row['direction']}: "
                   f"{millis(row['translation_error'])} mm {millis(row['rotation_error'])} mrad, {row['reason']}, "
                   + ("ACCEPTED" if row["accepted"] else "rejected"))


class Runner:
    def __init__(self, store, jobs):
        self.store, self.jobs = store, jobs

    def run(self, chains):
        """`chains`: lists of steps that follow each other. Yields the index of each chain as it ends."""
        with concurrent.futures.ThreadPoolExecutor(max_workers=self.jobs) as pool:
            futures = {pool.submit(self._chain, chain): n for n, chain in enumerate(chains)}
            for future in concurrent.futures.as_completed(futures):
                try:
                    future.result()
                except BaseException:
                    for other in futures:
                        other.cancel()
                    raise
                yield futures[future]

    def _chain(self, chain):
        for step in chain:
            if not self.store.is_done(step):
                begin = time.monotonic()
                self.store.run(step)
                print(f"  {step.name}: {time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)


def parse(arguments):
    parser = argparse.ArgumentParser(prog="evaluate", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"), help=argparse.SUPPRESS)
    for name in ("--scenes", "--frames", "--ours", "--page"):
        parser.add_argument(name, default="", help=argparse.SUPPRESS)
    parser.add_argument("--store", type=pathlib.Path, help=argparse.SUPPRESS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help=argparse.SUPPRESS)
    for flag in ("--quick", "--no-clouds", "--failures", "--list"):
        parser.add_argument(flag, action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def chosen_scenes(arguments):
    if arguments.frames:
        return [scenes.own_scene(arguments.frames)], []
    names = [name for name in arguments.scenes.split(",") if name]
    return scenes.available(arguments.data, names or (scenes.QUICK if arguments.quick else ()))


def parts_failed(name):
    """For a command's main: what goes wrong outside of it ends it with one line."""
    def decorate(main):
        def run(arguments):
            try:
                return main(arguments)
            except (StepError, LogError, scenes.SceneError, OSError) as error:
                sys.exit(f"{name}: error: {error}")
            except KeyboardInterrupt:
                sys.exit(f"{name}: interrupted; call it again to go on")
        return run
    return decorate


def plan_of(scene, a):
    if a.quick:
        plan = protocol.QUICK
    elif a.page and scene.name in protocol.SWEPT_AS_IN_THE_PAPER:
        plan = protocol.SWEPT_AS_IN_THE_PAPER[scene.name]
    else:
        plan = protocol.Plan()
    return dataclasses.replace(plan, clouds=(), paper=(), dense=(), small_clouds=False, without_prior=()) if a.no_clouds else plan


def command_line(a):
    """As a reader would repeat it: without the folders of this machine."""
    words = ["scripts/evaluate"] + ["--quick"] * a.quick + ["--no-clouds"] * a.no_clouds
    for name, value in (("--scenes", a.scenes), ("--ours", a.ours)):
        words += [name, value] if value else []
    words += ["--frames", "FOLDER"] if a.frames else ["--data", "DATA"] if a.data else []
    return " ".join(words + ["--page", "doc/results"])


@parts_failed("evaluate")
def main(arguments):
    a = parse(arguments)
    chosen, missing = chosen_scenes(a)
    if missing:
        print(f"not at hand (--data): {', '.join(missing)}", file=sys.stderr)
    if a.list:
        print(aligned([[s.name, s.what] for s in chosen]))
        return 0
    build, tools = tools_folder("ttsdf_evaluate", "ttsdf_build", "ttsdf_simulate")
    store = Store((a.store or build / "evaluation").resolve(), tools)
    parts = [protocol.steps_of(scene, a.data or "", plan_of(scene, a), a.ours) for scene in chosen]
    found, rows = {}, {}
    for n in Runner(store, max(1, a.jobs)).run([p.chain() for p in parts]):
        name = chosen[n].name
        found[name], rows[name] = figures.scene_figures(store, parts[n])
        sizes = ", ".join(f"rank {rank}: {found[name]['maps'][f'r{rank}']['file_bytes'] / 1e3:.1f} kB"
                          for rank in protocol.RANKS)
        print(f"\n{name} ({chosen[n].what}); maps {sizes}\n{scene_table(rows[name])}", flush=True)
        if a.failures:
            print("\n".join(failures(rows[name])), flush=True)
    if a.page:
        run_facts = facts.of_run(command_line(a), ("build", "register", "paper"))
        ordered = {scene.name: found[scene.name] for scene in chosen}
        print("\n".join(map(str, comparison_page.write(a.page, run_facts, ordered, rows))))
    return 0
