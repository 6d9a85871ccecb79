"""Steps of an evaluation, each run once: a command, and a folder named after the command and the code behind it.

A step's folder is <store>/<name>-<key>, and the key is a digest of the command and of the sources that decide its
result. A changed option or a changed source makes another folder; what is unchanged is not run again, whoever asks.
While a step runs its folder is called <...>.part, and an interrupted step goes on from there.
"""

import fcntl
import hashlib
import os
import pathlib
import shutil
import subprocess
import time
from dataclasses import dataclass

from . import code

ROOT = pathlib.Path(__file__).resolve().parents[2]
OUT = "{out}"  # in a command: the step's own folder
FINISHED = "finished.txt"


class StepError(Exception):
    pass


def tools_folder(*wanted):
    """(build folder, folder of the tools) of a build that has all that is wanted."""
    build = pathlib.Path(os.environ.get("TTSDF_BUILD_DIR", ROOT / "build"))
    for tools in (build / "devel" / "lib" / "ttsdf_localization", build):  # with ROS, without
        missing = [name for name in wanted if not (tools / name).exists()]
        if not missing:
            return build, tools
    raise StepError(f"got no {missing[0]} in {build}: run scripts/build first, or set TTSDF_BUILD_DIR")


@dataclass
class Step:
    """`command`: program and arguments. A program "@name" is a script of this project. OUT in an argument stands for the
    step's folder, another step for that step's folder, a tuple for its parts in a row."""
    name: str
    command: list
    code: tuple = ()  # names of parts of the code, see code.PARTS
    makes: str = ""   # folder that a tool insists on making itself: removed when an interrupted step starts again

    def needs(self):
        """Steps whose folders the command uses."""
        parts = [part for word in self.command for part in (word if isinstance(word, tuple) else (word,))]
        return [part for part in parts if isinstance(part, Step)]


class Store:
    def __init__(self, folder, tools):
        self.folder, self.tools = pathlib.Path(folder), tools
        self.started = time.monotonic()

    def path(self, step):
        # Relative to the store and to the checkout: both may be moved.
        text = "\0".join(map(self._word, step.command)).replace(str(self.folder), "").replace(str(ROOT), "")
        key = hashlib.sha256((text + code.digest(step.code)).encode()).hexdigest()[:12]
        return self.folder / f"{step.name}-{key}"

    def is_done(self, step):
        return (self.path(step) / FINISHED).exists()

    def _word(self, word):
        if isinstance(word, tuple):
            return "".join(map(self._word, word))
        return str(self.path(word)) if isinstance(word, Step) else str(word)

    def _words(self, step, folder):
        name, *arguments = step.command
        program = ROOT / "scripts" / name[1:] if name.startswith("@") else self.tools / name
        return [str(program)] + [self._word(a).replace(OUT, str(folder)) for a in arguments]

    def run(self, step):
        """Runs it unless it is done; returns its folder."""
        target = self.path(step)
        if self.is_done(step):
            return target
        part = target.with_name(target.name + ".part")
        part.mkdir(parents=True, exist_ok=True)
        with open(str(target) + ".lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # another run may want the same step
            if self.is_done(step):
                return target
            if step.makes:
                shutil.rmtree(part / step.makes, ignore_errors=True)
            begin = time.monotonic()
            result = subprocess.run(self._words(step, part), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                    universal_newlines=True)
            if result.returncode != 0:
                words = result.stderr.strip().splitlines() or [f"exit code {result.returncode}"]
                raise StepError(f"{step.name}: {words[-1]}")
            (part / FINISHED).write_text(f"{time.monotonic() - begin:.1f} s\n" + result.stdout)
            part.rename(target)
            os.unlink(lock.name)
        return target
