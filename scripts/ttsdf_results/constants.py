"""Chooses constants of the registration with one scene left out at a time; writes doc/results/constants.md.

usage: scripts/results constants [--data FOLDER] [--scenes NAMES] [--page FOLDER] [--store FOLDER] [--jobs N]

  --data FOLDER   folder with the public sequences (default $TTSDF_TEST_DATA); scenes that are not there are left out
  --scenes NAMES  only these, with commas between
  --page FOLDER   where constants.md goes (default: STORE/page)

A run counts 1 if its pose is right (within 5 cm) and accepted, 0 if it is refused, and -10 if it is wrong and accepted. A scene
counts as the mean of its runs. For every scene the value is chosen that is best on the mean of the *other* scenes; the value in
use where it is as good.
"""

import argparse
import os
import pathlib

from . import facts, protocol, scenes
from .evaluate import Runner, parts_failed
from .logs import in_order, of_method, read_log, share, succeeded
from .store import Store, tools_folder
from .text import markdown

WRONG = -10.0
# option -> values, the one in use first.
RUN_AGAIN = {
    "restarts": (32, 8, 128),
    "restart_score": (0.25, 0.12, 0.5),
    "degenerate_threshold": (0.0003, 0.0001, 0.001),
    "min_known_ratio": (0.2, 0.1, 0.35),
}
MIN_CONFIDENCE = (0.75, 0.5, 0.65, 0.85, 0.95)  # needs no run of its own: the logs hold every confidence
PLAN = protocol.Plan(scans=10, directions=1, translations="0.1,0.5,1.0", rotations="0.25", clouds=(), paper=())
METHOD = f"ours_r{protocol.RANKS[-1]}"


def worth(rows, min_confidence=None):
    """Mean of the runs of one scene."""
    def accepted(row):
        if min_confidence is None:
            return row["accepted"]
        return (row["accepted"] or row["reason"] == "unsure") and row["confidence"] >= min_confidence

    return share([(1.0 if succeeded(row) else WRONG) if accepted(row) else 0.0 for row in rows])


def best_without(left_out, table):
    """`table`: value -> scene -> worth, the value in use first."""
    def mean(value):
        return share([w for scene, w in table[value].items() if scene != left_out])

    return max(table, key=lambda value: round(mean(value), 4))  # the first of equals


def section(option, table, milliseconds):
    """`milliseconds`: value -> mean of all runs; None where the value changes no run."""
    names = in_order(next(iter(table.values())))
    used = next(iter(table))
    chosen = {name: best_without(name, table) for name in names}
    head = ["scene"] + [f"{value:g}" + (" (in use)" if value == used else "") for value in table] + ["chosen without it", "worth there"]
    rows = [[name] + [f"{table[value][name]:.2f}" for value in table] +
            [f"{chosen[name]:g}", f"{table[chosen[name]][name]:.2f}"] for name in names]
    means = [share(list(table[value].values())) for value in table]
    rows.append(["**mean**"] + [f"{mean:.3f}" for mean in means] + ["", f"{share([table[chosen[n]][n] for n in names]):.3f}"])
    if milliseconds:
        rows.append(["**time of a run, mean [ms]**"] + [f"{milliseconds[value]:.1f}" for value in table] + ["", ""])
    agree = sum(value == used for value in chosen.values())
    return (f"## {option}\n\nThe value in use is chosen in {agree} of {len(names)} cases.\n\n" + markdown(head, rows),
            {"agree": agree, "scenes": len(names), "means": {f"{v:g}": m for v, m in zip(table, means)}})


def parse(arguments):
    parser = argparse.ArgumentParser(prog="results constants", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"))
    parser.add_argument("--scenes", default="")
    parser.add_argument("--page", default="")
    parser.add_argument("--store", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    return parser.parse_args(arguments)


@parts_failed("results constants")
def main(arguments):
    a = parse(arguments)
    chosen, _ = scenes.available(a.data, [name for name in a.scenes.split(",") if name])
    build, tools = tools_folder("ttsdf_evaluate", "ttsdf_build", "ttsdf_simulate")
    store = Store((a.store or build / "evaluation").resolve(), tools)
    settings = [""] + [f"{option}={value:g}" for option, values in RUN_AGAIN.items() for value in values[1:]]
    parts = {(scene.name, setting): protocol.steps_of(scene, a.data or "", PLAN, setting) for scene in chosen for setting in settings}
    for setting in settings:  # the first one makes the maps of all
        for _ in Runner(store, max(1, a.jobs)).run([parts[scene.name, setting].chain() for scene in chosen]):
            pass
    rows = {key: of_method(read_log(store.path(p.parts["ours"]) / protocol.LOG), METHOD) for key, p in parts.items()}
    names = [scene.name for scene in chosen]
    tables = {option: {value: {n: worth(rows[n, f"{option}={value:g}" if k else ""]) for n in names}
                       for k, value in enumerate(values)} for option, values in RUN_AGAIN.items()}
    tables["min_confidence"] = {v: {n: worth(rows[n, ""], v) for n in names} for v in MIN_CONFIDENCE}
    def mean_milliseconds(setting):
        return share([row["cpu_ms"] for name in names for row in rows[name, setting]])

    times = {option: {value: mean_milliseconds(f"{option}={value:g}" if k else "") for k, value in enumerate(values)}
             for option, values in RUN_AGAIN.items()}
    sections = {option: section(option, table, times.get(option)) for option, table in tables.items()}
    runs = facts.of_run("scripts/results constants --data DATA --page doc/results", ("build", "register"))
    text = ("# Constants\n\n" + facts.sentence(runs) + f"\n\nWhich values of options would be chosen with one scene left out at a "
            f"time ({len(names)} scenes, maps of rank {protocol.RANKS[-1]}, {len(rows[names[0], ''])} runs each or as many as it has "
            "scans for). A run counts 1 if its pose is right (within 5 cm) and accepted, 0 if refused, -10 if wrong and accepted; a "
            "scene is the mean of its runs. A value that is worth a little more is not in use where its time is too much for that. *Worth there*: of the value chosen without the scene, on it. What is not here is derived "
            "from voxel size, range of the scan and noise of the sensor, not chosen; the weights of the confidence are fitted by "
            "`scripts/results fit_confidence`, each scene by the others.\n\n" + "\n\n".join(s[0] for s in sections.values()))
    print(facts.write(a.page or store.folder / "page", "constants", text, runs, {o: s[1] for o, s in sections.items()}))
    return 0
