"""Reads what ttsdf_evaluate writes, and condenses it."""

import csv
import pathlib
from dataclasses import dataclass

import numpy as np

SUCCESS_DISTANCE = 0.05  # [m], as in evaluation/sweep.h
CONSISTENT = 16.8        # 99 % of a chi-squared distribution of six degrees of freedom lie below it
NUMBERS = ("magnitude", "translation_error", "rotation_error", "ms", "cpu_ms", "mahalanobis_squared", "confidence")


class LogError(Exception):
    pass


def read_log(path):
    """Rows of one log, numbers as numbers. A last row cut off by an interruption is left out."""
    text = pathlib.Path(path).read_text()
    rows = []
    for number, row in enumerate(csv.DictReader(text[:text.rfind("\n") + 1].splitlines()), start=2):
        try:
            row.update({key: float(row[key]) for key in NUMBERS})
            row["accepted"] = row["accepted"] == "1"
        except (KeyError, TypeError, ValueError) as error:
            raise LogError(f"{path}, line {number}: {error!r}") from error
        rows.append(row)
    return rows


def in_order(values):
    return list(dict.fromkeys(values))


def share(values):
    return float(np.mean(values)) if len(values) else float("nan")


def quartiles(values):
    return tuple(np.percentile(values, (25, 50, 75))) if len(values) else (float("nan"),) * 3


@dataclass
class Cell:
    """All runs of a method that one line or one cell of a table is about."""
    runs: int
    success: float         # share of runs within SUCCESS_DISTANCE
    accepted_wrong: float  # share of runs that the method stands by and that are not
    translation: tuple     # quartiles of the successes [m]
    rotation: tuple        # [rad]
    translation_of_all: tuple
    rotation_of_all: tuple
    consistent: float      # share of accepted runs with a squared Mahalanobis distance below CONSISTENT; NaN: no covariance
    mahalanobis: float     # median of that distance
    milliseconds: float    # processor time, median


def succeeded(row):
    return row["translation_error"] < SUCCESS_DISTANCE


def condense(rows):
    good = [row for row in rows if succeeded(row)]
    distances = np.array([row["mahalanobis_squared"] for row in rows if row["accepted"]])
    distances = distances[~np.isnan(distances)]

    def of(which, key):
        return quartiles([row[key] for row in which])

    return Cell(len(rows), share([succeeded(row) for row in rows]),
                share([row["accepted"] and not succeeded(row) for row in rows]),
                of(good, "translation_error"), of(good, "rotation_error"),
                of(rows, "translation_error"), of(rows, "rotation_error"),
                share(distances < CONSISTENT), float(np.median(distances)) if len(distances) else float("nan"),
                float(np.median([row["cpu_ms"] for row in rows])) if rows else float("nan"))


def perturbation(row):
    return row["kind"], row["magnitude"]


def perturbations(rows):
    """(kind, magnitude), translations first, rising."""
    return sorted({perturbation(row) for row in rows}, key=lambda p: (p[0] != "translation", p[1]))


def of_method(rows, method):
    return [row for row in rows if row["method"] == method]
