"""The whole node over a recorded sequence: bags of it, replayed in real time through depth_image_proc and the localizer.

usage: scripts/results node [--data FOLDER] [--rates HZ] [--page FOLDER] [--store FOLDER]

  --data FOLDER   folder with redkitchen/ (default $TTSDF_TEST_DATA)
  --rates LIST    frames per second of the bags without odometry (default 30,15,10,5)
  --page FOLDER   where node.md goes (default: STORE/page)

Needs a build with ROS. A master and logs of its own; nothing here meets another roscore of this machine.
"""

import argparse
import contextlib
import os
import pathlib
import random
import re
import signal
import socket
import subprocess
import tempfile

from . import facts, protocol, scenes
from .evaluate import parts_failed
from .store import OUT, ROOT, Step, Store, StepError, tools_folder
from .text import markdown


def free_port():
    for port in random.sample(range(12000, 30000), 1000):
        with socket.socket() as one, contextlib.suppress(OSError):
            one.bind(("", port))
            return port
    raise StepError("got no free TCP port, wanted one for a ROS master")


class Ros:
    """The development space's environment, with a private master."""

    def __init__(self, build):
        setup = build / "devel" / "setup.bash"
        if not setup.exists():
            raise StepError(f"got no {setup}, wanted a build with ROS (scripts/build)")
        text = subprocess.run(["bash", "-c", f". '{setup}' && env -0"], stdout=subprocess.PIPE, check=True).stdout.decode()
        self.environment = dict(item.split("=", 1) for item in text.split("\0") if "=" in item)
        self.port = free_port()
        self.home = tempfile.TemporaryDirectory(prefix="ttsdf_results_ros_")
        self.environment.update(ROS_MASTER_URI=f"http://localhost:{self.port}", ROS_HOSTNAME="localhost",
                                ROS_HOME=self.home.name, ROS_LOG_DIR=self.home.name + "/log")

    def launch(self, log, file, *arguments):
        with open(log, "w") as out:
            process = subprocess.Popen(["roslaunch", "-p", str(self.port), "ttsdf_localization", file, *arguments], stdout=out,
                                       stderr=subprocess.STDOUT, env=self.environment, start_new_session=True)
            try:
                code = process.wait(timeout=1200)
            except BaseException:
                os.killpg(process.pid, signal.SIGTERM)
                raise
        if code != 0:
            raise StepError(f"{file} failed: see {log}")


def bag_step(frames, name, *options):
    return Step(f"node/bag-{name}", ["@frames_to_bag", *options, frames, OUT + "/run.bag"])


def replay(ros, store, name, bag, tt_map, folder, *arguments):
    """What evaluate_trajectory prints of the poses that the node published."""
    folder.mkdir(parents=True, exist_ok=True)
    record = folder / f"{name}.bag"
    record.unlink(missing_ok=True)
    ros.launch(folder / f"{name}.log", "replay.launch", f"bag:={store.path(bag)}/run.bag",
               f"map:={store.path(tt_map)}/{protocol.MAP}", f"record:={record}", *arguments)
    return subprocess.run([str(ROOT / "scripts" / "evaluate_trajectory"), f"{record}:ground_truth", f"{record}:pose", "--status",
                           f"{record}:status"], stdout=subprocess.PIPE, universal_newlines=True, check=True,
                          env=ros.environment).stdout


def line_of(text, word):
    found = re.search(rf"^\s*{word}\s+(.*)$", text, re.MULTILINE)
    return found.group(1).strip() if found else ""


@parts_failed("node")
def main(arguments):
    parser = argparse.ArgumentParser(prog="results node", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"), help=argparse.SUPPRESS)
    parser.add_argument("--rates", default="30,15,10,5", help=argparse.SUPPRESS)
    for name in ("--page", "--store"):
        parser.add_argument(name, type=pathlib.Path, help=argparse.SUPPRESS)
    a = parser.parse_args(arguments)
    there, _ = scenes.available(a.data, ("redkitchen",))
    if not there:
        raise StepError("got no folder with redkitchen/, wanted --data FOLDER")
    build, tools = tools_folder("localization_node", "ttsdf_build")
    store = Store((a.store or build / "evaluation").resolve(), tools)
    builder = protocol.SceneProtocol(there[0], a.data, protocol.Plan())
    tt_map = builder.build("r40", "--max-rank", 40)
    runs = {"odometry that drifts by 5 % and 0.05 rad/m": (bag_step(builder.frames, "odometry"), "odom_frame_id:=odom")}
    for rate in a.rates.split(","):
        runs[f"no odometry, {rate} Hz"] = (bag_step(builder.frames, f"handheld-{rate}", "--no-odometry", "--rate", rate, "--every",
                                                    max(1, round(30 / float(rate)))), "odom_frame_id:=none")
    for step in protocol.in_order([tt_map, *(bag for bag, _ in runs.values())]):
        store.run(step)
    ros, texts = Ros(build), {}
    for n, (title, (bag, odometry)) in enumerate(runs.items()):
        texts[title] = replay(ros, store, f"run{n}", bag, tt_map, store.folder / "node", odometry)
        print(f"{title}\n{texts[title]}", flush=True)
    ros.home.cleanup()
    run_facts = facts.of_run("scripts/results node --data DATA", ("build", "localize"))
    words = ("poses", "position", "rotation", "states", "scan age")
    rows = [[title, *(line_of(text, word) for word in words)] for title, text in texts.items()]
    text = "\n\n".join(["# The node", facts.sentence(run_facts),
                        "Red kitchen, bags of its frames (640 x 480), replayed in real time through depth_image_proc and the "
                        "localization nodelet; the map is of every 10th frame, rank 40.",
                        markdown(["run", *words], rows)])
    print(facts.write(a.page or store.folder / "page", "node", text, run_facts, texts))
    return 0
