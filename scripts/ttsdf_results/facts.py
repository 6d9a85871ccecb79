"""What a page says about the run that it comes from, and what tells later whether it is still of today's code.

Every page has a file of the same name with the ending .json beside it: commit, machine, the digest of the code that it
measures, and its figures.
"""

import datetime
import json
import os
import pathlib
import platform
import subprocess

from . import code
from .store import ROOT

RESULTS = ROOT / "doc" / "results"


def git(*arguments):
    try:
        return subprocess.run(["git", *arguments], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              universal_newlines=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def commit():
    changed = git("status", "--porcelain", "--", "src", "include", "scripts")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (" with local changes" if changed else "")


def machine():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or "unknown processor"
    return f"{name}, {os.cpu_count()} cores, {os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB"


def of_run(command, parts):
    """`parts`: of the code (code.PARTS) that decides the figures."""
    return {"command": command, "commit": commit(), "date": datetime.date.today().isoformat(), "machine": machine(),
            "load": round(os.getloadavg()[0], 1), "code": {part: code.digest((part,)) for part in parts}}


def sentence(facts):
    return (f"Made by `{facts['command']}`, commit {facts['commit']}, {facts['date']}, on {facts['machine']}; load of the "
            f"machine at the end {facts['load']}. Times are processor times unless a column says otherwise.")


def write(folder, name, text, facts, figures):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text.rstrip() + "\n")
    (folder / f"{name}.json").write_text(json.dumps({**facts, "figures": figures}, indent=1, sort_keys=True) + "\n")
    return folder / f"{name}.md"


def read(name, folder=RESULTS):
    path = pathlib.Path(folder) / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None
