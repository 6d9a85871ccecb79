"""Reads the logs of scripts/registration_report and condenses them to the figures of its page."""

import csv
import json
import pathlib
import re
from dataclasses import dataclass

import numpy as np

import poses
from evaluation_data import SUCCESS_DISTANCE, DataError

CHI2_6_99 = 16.81  # 99 % of squared Mahalanobis distances in six dimensions are below
COORDINATES = ("rotation x", "y", "z", "translation x", "y", "z")


def read_benchmarks(path):
    """Name of a benchmark -> its entry in Google Benchmark's JSON, the median of repetitions; `seconds` of processor time."""
    units = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
    found = {}
    try:
        for entry in json.loads(pathlib.Path(path).read_text())["benchmarks"]:
            name = re.split("/(?:iterations|repeats):", entry["run_name"])[0]
            median = entry.get("aggregate_name") == "median"
            if median or name not in found and entry["run_type"] == "iteration":
                found[name] = {**entry, "seconds": entry["cpu_time"] * units[entry["time_unit"]]}
    except (KeyError, ValueError, TypeError) as error:
        raise DataError(f"{path}: got no log of Google Benchmark: {error!r}") from error
    return found


def series(benchmarks, family, value):
    """[(argument, value)] of the benchmarks `family/name:argument`, rising."""
    found = []
    for name, entry in benchmarks.items():
        head, _, argument = name.rpartition(":")
        if head.rpartition("/")[0] == family:
            found.append((int(argument), entry[value]))
    if not found:
        raise DataError(f"got no benchmark {family}, wanted some")
    return sorted(found)


def paired_ratio(rows, one, other):
    """Median over runs from the same prior of the time of method `one` divided by that of `other`."""
    def times(method):
        return {(row["dataset"], row["scan"], row["kind"], row["magnitude"], row["direction"]): row["cpu_ms"]
                for row in rows if row["method"] == method}
    mine, its = times(one), times(other)
    shared = [key for key in mine if its.get(key, 0.0) > 0.0]
    if not shared:
        raise DataError(f"got no run of both {one} and {other}")
    return float(np.median([mine[key] / its[key] for key in shared]))


@dataclass
class Answers:
    """What a method without a prior said."""
    scans: int
    near: int      # within 5 cm
    accepted: int
    wrong: int     # accepted, and farther away
    seconds: tuple  # wall clock: median, largest
    processor: float  # median seconds of all threads together: what a busy machine does not change

    @property
    def refused(self):
        return self.scans - self.accepted


def answers(rows, same_place=True):
    """In the map of another place every accepted answer is wrong."""
    near = [same_place and row["translation_error"] < SUCCESS_DISTANCE for row in rows]
    accepted = [row["accepted"] == "1" for row in rows]
    milliseconds = [row["ms"] for row in rows]
    return Answers(len(rows), sum(near), sum(accepted), sum(a and not n for a, n in zip(accepted, near)),
                   (1e-3 * float(np.median(milliseconds)), 1e-3 * max(milliseconds)),
                   1e-3 * float(np.median([row["cpu_ms"] for row in rows])))


def log_so3(R):
    """Rotation vector [rad], away from half turns."""
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    norm = np.linalg.norm(axis)
    return axis * (poses.rotation_angle(R) / norm) if norm > 1e-15 else np.zeros(3)


@dataclass
class Trial:
    error: np.ndarray       # truth against the estimate: [rotation; translation] about the sensor, map frame
    covariance: np.ndarray  # 6 x 6


@dataclass
class Consistency:
    """How reported covariances hold up against the truth."""
    trials: int
    within: np.ndarray   # share of truths within 3 sigma, per coordinate
    all_within: float    # in all six at once
    mean_square: float   # of Mahalanobis distances; 6 if the covariance is right
    median_square: float  # 5.35 if it is
    below_99: float      # share below the 99 % point of chi-square: 0.99 if it is
    sigma: np.ndarray    # median of the reported standard deviations
    spread: np.ndarray   # root mean square of errors, the largest percent left out


def consistency(trials):
    errors = np.array([t.error for t in trials])
    sigmas = np.array([np.sqrt(np.diag(t.covariance)) for t in trials])
    squares = np.array([t.error @ np.linalg.solve(t.covariance, t.error) for t in trials])
    inside = np.abs(errors) <= 3.0 * sigmas
    trimmed = np.sort(errors ** 2, axis=0)[:max(1, int(0.99 * len(trials)))]
    return Consistency(len(trials), inside.mean(axis=0), float(inside.all(axis=1).mean()), float(squares.mean()),
                       float(np.median(squares)), float((squares < CHI2_6_99).mean()), np.median(sigmas, axis=0),
                       np.sqrt(trimmed.mean(axis=0)))


def read_rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def read_uncertainty(log, batch):
    """(trials, weak directions per estimate, scans) of a ttsdf_register log with its uncertainty beside it."""
    log, batch = pathlib.Path(log), pathlib.Path(batch)
    rows = read_rows(log)
    beside = read_rows(log.with_name(log.stem + "_uncertainty.csv"))
    truths = dict(line.split()[::2] for line in (batch / "list.txt").read_text().splitlines())
    if [r["scan"] for r in rows] != [r["scan"] for r in beside]:
        raise DataError(f"{log}: got other scans than in the uncertainty beside it")
    trials, weak = [], []
    for row, uncertainty in zip(rows, beside):
        if row["success"] != "1":
            continue
        weak.append(int(uncertainty["weak_directions"]))
        covariance = np.array([[float(uncertainty[f"c{a}{b}"]) for b in range(6)] for a in range(6)])
        truth = np.loadtxt(batch / truths[row["scan"]])
        R = poses.rotation_from_quaternion([float(row[key]) for key in ("qx", "qy", "qz", "qw")])
        t = np.array([float(row[key]) for key in ("tx", "ty", "tz")])
        error = np.concatenate((log_so3(truth[:3, :3] @ R.T), truth[:3, 3] - t))
        trials.append(Trial(error, covariance))
    return trials, weak, len(rows)
