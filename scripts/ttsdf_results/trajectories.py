"""The localizer over bags of whole sequences, with drifting odometry and without, at several rates, and with a part cut out.

usage: scripts/results trajectories [--data FOLDER] [--scenes NAMES] [--rates LIST] [--page FOLDER] [--store FOLDER] [--jobs N]

  --data FOLDER   folder with the public sequences (default $TTSDF_TEST_DATA); scenes that are not there are left out
  --scenes NAMES  some of redkitchen, tum_fr1_rpy, tabletop, room, apartment, building, with commas between
  --rates LIST    frames per second (default 30,15,10,5; every frame, every second one, ...)
  --page FOLDER   where trajectories.md goes (default: STORE/page)

Needs a build with ROS. Bags are removed as soon as they are localized.
"""

import argparse
import json
import os
import pathlib

from . import facts, protocol, scenes
from .evaluate import Runner, parts_failed
from .store import OUT, Step, Store, tools_folder
from .text import markdown

# Long enough to be driven through.
SEQUENCES = ("redkitchen", "tum_fr1_rpy", "tabletop", "room", "apartment", "building")
RECORDED = 30.0  # frames per second of the sequences
CUT_RATE = 15.0
HEAD = ["scene", "bag", "scans", "poses", "rmse [mm]", "largest [mm]", "further than 10 cm"]
CUT_HEAD = ["scene", "scans", "poses", "further than 10 cm", "doubted after [s]", "last wrong pose after [s]", "right again after [s]"]


def run_step(builder, tt_map, localizer, rate, odometry, cut=False):
    every = max(1, round(RECORDED / rate))
    name = f"{builder.scene.name}/trajectory-{rate:g}{'' if odometry else '-no-odometry'}{'-cut' if cut else ''}"
    command = ["@results", "trajectory", "--frames", builder.frames, "--map", (tt_map, "/" + protocol.MAP), "--localizer", localizer,
               "--output", OUT, "--depth-scale", builder.scene.depth_scale, "--every", every, "--rate", RECORDED / every]
    return Step(name, command + ([] if odometry else ["--no-odometry"]) + (["--cut"] if cut else []), ("localize",))


def millimetres(value):
    return "-" if value is None else f"{1e3 * value:.1f}"


def seconds(value):
    return "-" if value is None else f"{value:.2f}"


def parse(arguments):
    parser = argparse.ArgumentParser(prog="results trajectories", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"), help=argparse.SUPPRESS)
    parser.add_argument("--scenes", default=",".join(SEQUENCES), help=argparse.SUPPRESS)
    parser.add_argument("--rates", default="30,15,10,5", help=argparse.SUPPRESS)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help=argparse.SUPPRESS)
    for name in ("--page", "--store"):
        parser.add_argument(name, type=pathlib.Path, help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


@parts_failed("results trajectories")
def main(arguments):
    a = parse(arguments)
    chosen, missing = scenes.available(a.data, a.scenes.split(","))
    build, tools = tools_folder("offline_localizer", "ttsdf_build", "ttsdf_simulate")
    store = Store((a.store or build / "evaluation").resolve(), tools)
    runs, chains = {}, []
    for scene in chosen:
        builder = protocol.SceneProtocol(scene, a.data or "", protocol.Plan())
        tt_map = builder.build("r40", "--max-rank", 40)
        for rate in map(float, a.rates.split(",")):
            for odometry in (True, False):
                runs[scene.name, rate, odometry, False] = run_step(builder, tt_map, tools / "offline_localizer", rate, odometry)
        runs[scene.name, CUT_RATE, False, True] = run_step(builder, tt_map, tools / "offline_localizer", CUT_RATE, False, cut=True)
        chains.append(protocol.in_order([step for key, step in runs.items() if key[0] == scene.name]))
    for n in Runner(store, max(1, a.jobs)).run(chains):
        print(f"{chosen[n].name}: done", flush=True)
    found = {key: json.loads((store.path(step) / "result.json").read_text()) for key, step in runs.items()}
    rows, cuts = [], []
    for (scene, rate, odometry, cut), r in found.items():
        if cut:
            cuts.append([scene, r["scans"], r["poses"], r["wrong"], seconds(r["doubted_after"]), seconds(r["last_wrong_after"]),
                         seconds(r["right_after"])])
        else:
            rows.append([scene, f"{rate:g} Hz, " + ("odometry" if odometry else "no odometry"), r["scans"], r["poses"],
                         millimetres(r["rmse"]), millimetres(r["largest"]), r["wrong"]])
    run_facts = facts.of_run("scripts/results trajectories --data DATA --page doc/results", ("build", "localize"))
    text = "\n\n".join([
        "# Trajectories", facts.sentence(run_facts),
        "Whole sequences as bags through `offline_localizer` (the node's localizer, every scan): with odometry that drifts by 5 % and "
        "0.05 rad/m, and without any, as a camera carried by hand. At 30 Hz every frame, at 5 Hz every sixth: the motion between scans "
        "grows. The maps are those of rank 40 of the [comparison](README.md); some scans are frames of the map. A pose that is "
        "missing was not published: the state said so. The building's camera flies faster than any robot.",
        markdown(HEAD, rows),
        "## Carried on while covered",
        f"The middle third of the sequence is left out, without odometry, {CUT_RATE:g} Hz: the camera is somewhere else from one scan "
        "to the next. *Doubted*: the first scan whose state is not tracking; times count from the first scan after the cut.",
        markdown(CUT_HEAD, cuts)])
    print(facts.write(a.page or store.folder / "page", "trajectories", text, run_facts, {" ".join(map(str, k)): r for k, r in found.items()}))
    if missing:
        print(f"not at hand (--data): {', '.join(missing)}")
    return 0
