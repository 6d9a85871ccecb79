"""Runs the steps of a report: one command each, once."""

import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]


class StepError(Exception):
    pass


class Runner:
    """Runs steps that have not been run, and remembers in done.json what has."""

    def __init__(self, tools, output):
        self.tools, self.output = tools, output
        self.record = output / "done.json"
        self.done = json.loads(self.record.read_text()) if self.record.exists() else {}
        self.lock = threading.Lock()
        self.started = time.monotonic()

    def key(self, step):
        """The command with folders relative to the output, so that the output may be moved."""
        text = "\0".join(map(str, step.command)).replace(str(self.output), "")
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def is_done(self, step):
        return self.key(step) in self.done and all(pathlib.Path(made).exists() for made in step.makes)

    def program(self, name):
        name = str(name)
        return str(ROOT / "scripts" / name[1:]) if name.startswith("@") else str(self.tools / name)

    def run(self, step):
        for made in map(pathlib.Path, step.makes):
            made.parent.mkdir(parents=True, exist_ok=True)
            if made.is_dir():  # frames of an interrupted run
                shutil.rmtree(made)
        command = [self.program(step.command[0]), *map(str, step.command[1:])]
        begin = time.monotonic()
        # The last words of a tool are the reason why it failed.
        result = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True)
        if result.returncode != 0:
            words = result.stderr.strip().splitlines() or [f"exit code {result.returncode}"]
            raise StepError(f"{step.title}: {words[-1]}")
        with self.lock:
            self.done[self.key(step)] = {"title": step.title, "seconds": round(time.monotonic() - begin, 1)}
            temporary = self.record.with_suffix(".new")
            temporary.write_text(json.dumps(self.done, indent=1))
            temporary.replace(self.record)


def tools_folder(*wanted):
    """(build folder, folder of the tools) of a build that has all that is wanted."""
    build = pathlib.Path(os.environ.get("TTSDF_BUILD_DIR", ROOT / "build"))
    for tools in (build / "devel" / "lib" / "ttsdf_localization", build):  # with ROS, without
        missing = [name for name in wanted if not (tools / name).exists()]
        if not missing:
            return build, tools
    raise StepError(f"got no {missing[0]} in {build}: run scripts/build first, or set TTSDF_BUILD_DIR")
