"""Resident memory of localization_node, without a map and with one; and beside the node of another build.

usage: scripts/results node --map MAP.ttsdf [--frames FOLDER --against BUILD COMMIT [--against-map MAP.ttsdf] [--rounds N]]
                            [--page FOLDER]

  --map MAP.ttsdf         a room's map
  --frames FOLDER         its frames: both nodes get every fifth of them from one bag, at real speed
  --against BUILD COMMIT  build folder of another commit with localization_node (scripts/build --no-tests localization_node)
  --against-map MAP.ttsdf the map of that node (default: the same)
  --rounds N              both nodes in turn, so often (default 5)
  --page FOLDER           where node.md goes (default: BUILD/evaluation/page)

Needs a build with ROS; it has a master of its own.
"""

import argparse
import contextlib
import os
import pathlib
import signal
import subprocess
import tempfile
import time
import xmlrpc.client

from . import facts
from .evaluate import parts_failed
from .ros import Ros
from .store import StepError, tools_folder
from .text import markdown


def resident(pid):
    """(resident, of which not of files, largest resident so far) [MB] of a process."""
    fields = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines() if ":" in line)
    return tuple(int(fields[key].split()[0]) * 1024 / 1e6 for key in ("VmRSS", "RssAnon", "VmHWM"))


def settled(pid, seconds=3.0):
    """Memory of a process once it has not changed for so long."""
    last, since = resident(pid), time.monotonic()
    while time.monotonic() - since < seconds:
        time.sleep(0.2)
        now = resident(pid)
        if abs(now[0] - last[0]) > 0.05:
            last, since = now, time.monotonic()
    return last


def wait_for(what, known, seconds=60.0):
    end = time.monotonic() + seconds
    while True:
        try:
            if known():
                return
        except OSError:
            pass
        if time.monotonic() > end:
            raise StepError(f"got no {what} after {seconds:.0f} s")
        time.sleep(0.2)


@contextlib.contextmanager
def private_master(build):
    ros = Ros(build)
    master = subprocess.Popen(["roscore", "-p", str(ros.port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              env=ros.environment, start_new_session=True)
    api = xmlrpc.client.ServerProxy(ros.environment["ROS_MASTER_URI"])
    try:
        wait_for("ROS master", lambda: api.getPid("/results")[0] == 1)
        yield ros, api
    finally:
        os.killpg(master.pid, signal.SIGINT)
        master.wait(timeout=20)
        ros.home.cleanup()


def measured(tt_map, build, tools):
    rows, figures = [], {}
    with private_master(build) as (ros, api):
        for name, words in (("without a map", []), ("with the room's map", [f"_map_file:={os.path.abspath(tt_map)}"])):
            node = subprocess.Popen([str(tools / "localization_node"), "__name:=localization", *words],
                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ros.environment)
            wait_for("localization_node", lambda: api.lookupNode("/results", "/localization")[0] == 1)
            figures[name] = settled(node.pid)
            if node.poll() is not None:
                raise StepError("localization_node ended by itself")
            node.send_signal(signal.SIGINT)
            node.wait(timeout=60)
            rows.append([name, *(f"{value:.1f}" for value in figures[name])])
    return markdown(["node", "resident [MB]", "of which not from files [MB]", "largest, while loading [MB]"], rows), figures


def beside_another(a, build):
    """The section that compares, and its figures."""
    from . import node_drive  # needs rospy and rosbag
    nodes = {"this commit": (build, a.map), a.against[1]: (a.against[0], a.against_map or a.map)}
    with private_master(build) as (ros, _), tempfile.TemporaryDirectory(prefix="ttsdf_results_bag_") as folder:
        bag = node_drive.bag_of_clouds(a.frames, pathlib.Path(folder))
        table, figures = node_drive.measured(nodes, bag, a.rounds, ros.environment, settled)
    return ("## Beside another commit\n\nThe same scans (organised clouds of 640 x 480 points at 10 Hz with odometry and its drift) "
            "at real speed, the two nodes in turn; medians of the rounds. Age: from the scan's start out of the bag to the receipt "
            "of its pose, wall time. Each with the map that its own build made of the same frames.\n\n" + table), figures


@parts_failed("node")
def main(arguments):
    parser = argparse.ArgumentParser(prog="results node", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--map", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--page", type=pathlib.Path, help=argparse.SUPPRESS)
    parser.add_argument("--frames", help=argparse.SUPPRESS)
    parser.add_argument("--against", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--against-map", help=argparse.SUPPRESS)
    parser.add_argument("--rounds", type=int, default=5, help=argparse.SUPPRESS)
    a = parser.parse_args(arguments)
    build, tools = tools_folder("localization_node")
    table, figures = measured(a.map, build, tools)
    command, beside = "scripts/results node --map " + pathlib.Path(a.map).name, []
    if a.against:
        section, figures["against"] = beside_another(a, build)
        beside = [section]
        command += f" --frames {pathlib.Path(a.frames).name} --against BUILD {a.against[1]} --rounds {a.rounds}"
    run_facts = facts.of_run(command, ("localize",))
    text = "\n\n".join([
        "# Memory of the node", facts.sentence(run_facts),
        "`localization_node`, resident memory once it does not change any more. What is from files is code of ROS and of libraries, "
        "shared with the other nodes of a machine. The map's own part: [maps in memory](memory.md).", table, *beside])
    print(facts.write(a.page or build / "evaluation" / "page", "node", text, run_facts, figures))
    return 0
