"""One bag of a sequence, localized by offline_localizer and compared with the truth.

usage: scripts/results trajectory --frames FOLDER --map FILE --localizer PROGRAM --output FOLDER [--depth-scale N] [--every N]
                                  [--rate HZ] [--no-odometry] [--cut]

  --cut   the middle third of the sequence is left out, as if the camera had been carried on while it was covered

Writes result.json. Times are stamps of the bag; the first is 1000 s.
"""

import argparse
import csv
import json
import pathlib
import shutil
import subprocess
import sys

import numpy as np

from depth_frames import INTRINSICS_NAMES, FrameError, FrameFolder
from trajectory_files import TrajectoryError, match, read_trajectory

from .store import ROOT

WRONG = 0.1  # [m]
SAME_STAMP = 0.001  # [s]
NO_POSE = 3  # exit code of offline_localizer


class RunError(Exception):
    pass


def call(*command, also=()):
    result = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
    if result.returncode not in (0, *also):
        raise RunError(f"{command[0]}: {(result.stdout.strip().splitlines() or [result.returncode])[-1]}")
    return result.returncode


def link_frames(frames, every, without_middle, folder):
    """Links to every n-th frame that is there, with numbers in a row; the number of the first one after the cut."""
    source = FrameFolder(frames)
    chosen = source.indices[::every]
    third = len(chosen) // 3 if without_middle else 0
    if without_middle:
        chosen = chosen[:third] + chosen[-third:]
    folder.mkdir(parents=True, exist_ok=True)
    for name in INTRINSICS_NAMES:
        if (source.path / name).exists():
            shutil.copy(source.path / name, folder)
    for number, index in enumerate(chosen):
        for file in source.path.glob(f"frame-{index:06d}.*"):
            link = folder / ".".join([f"frame-{number:06d}", *file.name.split(".")[1:]])
            if not link.exists():
                link.symlink_to(file.resolve())
    return third


def errors_of(poses, truth):
    """stamp of the truth -> distance from it of every pose that was published [m]."""
    estimate = read_trajectory(str(poses))
    return {truth.stamps[i]: float(np.linalg.norm(truth.transforms[i][:3, 3] - estimate.transforms[j][:3, 3]))
            for i, j in match(truth, estimate, SAME_STAMP)}


def result_of(errors, truth, statuses, begin):
    """`begin`: stamp of the first scan after a cut, or of the first one."""
    values = np.array(list(errors.values()))
    wrong = sorted(stamp for stamp, error in errors.items() if error > WRONG)
    right = sorted(stamp for stamp, error in errors.items() if error <= WRONG and stamp >= begin)
    with statuses.open() as file:
        states = [(float(row["stamp"]), row["state"]) for row in csv.DictReader(file)]
    doubted = [stamp for stamp, state in states if stamp >= begin and state != "tracking"]
    return {"scans": len(truth.stamps), "poses": len(errors), "wrong": len(wrong),
            "rmse": float(np.sqrt(np.mean(values ** 2))) if len(values) else None,
            "largest": float(values.max()) if len(values) else None,
            "last_wrong_after": wrong[-1] - begin if wrong and wrong[-1] >= begin else None,
            "doubted_after": doubted[0] - begin if doubted else None,
            "right_after": right[0] - begin if right else None}


def parse(arguments):
    parser = argparse.ArgumentParser(prog="results trajectory", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("frames", "map", "localizer", "output"):
        parser.add_argument("--" + name, type=pathlib.Path, required=True)
    parser.add_argument("--depth-scale", type=float, default=1000.0)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--rate", type=float, default=30.0)
    parser.add_argument("--no-odometry", action="store_true")
    parser.add_argument("--cut", action="store_true")
    return parser.parse_args(arguments)


def main(arguments):
    a = parse(arguments)
    bag, poses, statuses = (a.output / name for name in ("run.bag", "poses.txt", "statuses.csv"))
    a.output.mkdir(parents=True, exist_ok=True)
    try:
        frames = a.output / "frames"
        after = link_frames(a.frames, a.every, a.cut, frames)
        odometry = ["--no-odometry"] if a.no_odometry else []
        call(ROOT / "scripts" / "frames_to_bag", frames, bag, "--rate", a.rate, "--depth-scale", a.depth_scale,
             "--compression", "none", *odometry)
        code = call(a.localizer, bag, "--map", a.map, "--depth", "camera/depth/image_rect", "--trajectory", poses, "--statuses", statuses,
             *(["--set", "odom_frame_id=none"] if a.no_odometry else []), also=(NO_POSE,))
        truth = read_trajectory(f"{bag}:ground_truth")
        errors = {} if code == NO_POSE else errors_of(poses, truth)
        (a.output / "result.json").write_text(json.dumps(result_of(errors, truth, statuses, truth.stamps[after])) + "\n")
    except (RunError, FrameError, TrajectoryError) as error:
        print(f"trajectory: error: {error}", file=sys.stderr)
        return 1
    finally:
        if bag.exists():
            bag.unlink()
    return 0
