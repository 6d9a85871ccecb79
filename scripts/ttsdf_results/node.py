"""Resident memory of localization_node, without a map and with one.

usage: scripts/results node --map MAP.ttsdf [--page FOLDER]

  --map MAP.ttsdf  a room's map
  --page FOLDER    where node.md goes (default: BUILD/evaluation/page)

Needs a build with ROS; it has a master of its own.
"""

import argparse
import os
import pathlib
import signal
import subprocess
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


def measured(tt_map, build, tools):
    ros, rows, figures = Ros(build), [], {}
    master = subprocess.Popen(["roscore", "-p", str(ros.port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              env=ros.environment, start_new_session=True)
    api = xmlrpc.client.ServerProxy(ros.environment["ROS_MASTER_URI"])
    try:
        wait_for("ROS master", lambda: api.getPid("/results")[0] == 1)
        for name, words in (("without a map", []), ("with the room's map", [f"_map_file:={os.path.abspath(tt_map)}"])):
            node = subprocess.Popen([str(tools / "localization_node"), "__name:=localization", *words],
                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ros.environment)
            wait_for("localization_node", lambda: api.lookupNode("/results", "/localization")[0] == 1)
            figures[name] = settled(node.pid)
            if node.poll() is not None:
                raise StepError("localization_node ended by itself")
            node.send_signal(signal.SIGINT)
            node.wait(timeout=10)
            rows.append([name, *(f"{value:.1f}" for value in figures[name])])
    finally:
        os.killpg(master.pid, signal.SIGINT)
        master.wait(timeout=20)
        ros.home.cleanup()
    return markdown(["node", "resident [MB]", "of which not from files [MB]", "largest, while loading [MB]"], rows), figures


@parts_failed("node")
def main(arguments):
    parser = argparse.ArgumentParser(prog="results node", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--map", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--page", type=pathlib.Path, help=argparse.SUPPRESS)
    a = parser.parse_args(arguments)
    build, tools = tools_folder("localization_node")
    table, figures = measured(a.map, build, tools)
    run_facts = facts.of_run("scripts/results node --map " + pathlib.Path(a.map).name, ("localize",))
    text = "\n\n".join([
        "# Memory of the node", facts.sentence(run_facts),
        "`localization_node`, resident memory once it does not change any more. What is from files is code of ROS and of libraries, "
        "shared with the other nodes of a machine. The map's own part: [maps in memory](memory.md).", table])
    print(facts.write(a.page or build / "evaluation" / "page", "node", text, run_facts, figures))
    return 0
