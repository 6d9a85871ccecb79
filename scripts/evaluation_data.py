"""Reads what ttsdf_evaluate and ttsdf_build wrote in an evaluation's output folder, and condenses it."""

import csv
import json
import pathlib
from dataclasses import dataclass

import numpy as np

SUCCESS_DISTANCE = 0.05  # [m], as in evaluation/sweep.h
KINDS = (("translation", "m"), ("rotation", "rad"))
NUMBERS = ("magnitude", "translation_error", "rotation_error", "ms", "cpu_ms")


ORDER = ("prior", "ours", "ours_search", "ours_not_compressed", "ours_1cm", "ours_global", "TT-SDF2PC", "TT-TSDF", "SDF2PC",
         "TSDF2PC", "ICP", "ICP_plane", "GICP", "NDT", "FPFH_RANSAC", "FPFH_FGR")


class DataError(Exception):
    pass


def read_log(path):
    """Rows of one log, numbers as numbers. A last row cut off by an interruption is left out."""
    text = pathlib.Path(path).read_text()
    lines = text[:text.rfind("\n") + 1].splitlines()
    rows = []
    for number, row in enumerate(csv.DictReader(lines), start=2):
        try:
            row.update({key: float(row[key]) for key in NUMBERS})
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{path}, line {number}: {error!r}") from error
        rows.append(row)
    return rows


def read_logs(paths):
    return [row for path in paths for row in read_log(path)]


def group_name(dataset):
    """`objects-exact:armadillo` belongs to the group `objects-exact`."""
    return dataset.split(":")[0]


def common(rows):
    """The rows of perturbations that every method of a group answered: all are judged by the same ones, however far each
    of them got."""
    def key(row):
        return row["dataset"], row["scan"], row["kind"], row["magnitude"], row["direction"]

    answered = {}
    for row in rows:
        answered.setdefault((group_name(row["dataset"]), row["method"]), set()).add(key(row))
    shared = {}
    for (group, _), keys in answered.items():
        shared[group] = shared[group] & keys if group in shared else keys
    return [row for row in rows if key(row) in shared[group_name(row["dataset"])]]


def in_order(values):
    return list(dict.fromkeys(values))


def methods_in_order(rows):
    """The order of the tables, whatever the order of the log; methods that are not known here come last."""
    methods = in_order(row["method"] for row in rows)
    return sorted(methods, key=lambda m: ORDER.index(m) if m in ORDER else len(ORDER))


@dataclass
class Cell:
    """All runs of a method from perturbations of one magnitude."""
    runs: int
    success: float       # share
    translation: tuple   # quartiles [m], failures included
    rotation: tuple      # [rad]
    milliseconds: float  # processor time, median


def condense(rows):
    translation = np.array([row["translation_error"] for row in rows])
    rotation = np.array([row["rotation_error"] for row in rows])
    return Cell(len(rows), float(np.mean(translation < SUCCESS_DISTANCE)),
                tuple(np.percentile(translation, (25, 50, 75))), tuple(np.percentile(rotation, (25, 50, 75))),
                float(np.median([row["cpu_ms"] for row in rows])))


class Sweep:
    """method -> (kind, magnitude) -> Cell, of one group of data sets."""

    def __init__(self, rows):
        self.methods = methods_in_order(rows)
        self.scans = len({(row["dataset"], row["scan"]) for row in rows})
        cells = {}
        for row in rows:
            cells.setdefault((row["method"], row["kind"], row["magnitude"]), []).append(row)
        self.cells = {key: condense(value) for key, value in cells.items()}
        self.times = {method: float(np.median([row["cpu_ms"] for row in rows if row["method"] == method]))
                      for method in self.methods}

    def magnitudes(self, kind):
        return sorted({m for _, k, m in self.cells if k == kind})

    def cell(self, method, kind, magnitude):
        return self.cells.get((method, kind, magnitude))


class Evaluation:
    """Everything in an output folder."""

    def __init__(self, output):
        self.output = pathlib.Path(output)
        self.local = self._grouped("*/fields_*.csv", "*/clouds_*.csv")
        self.without_prior = self._grouped("*/global_*.csv")
        self.ranks = {row_set[0]["dataset"].split(":")[1]: row_set
                      for row_set in (read_log(p) for p in sorted(self.output.glob("*/ranks/sweep.csv"))) if row_set}
        self.memory = self._memory()

    def _grouped(self, *patterns):
        rows = common(read_logs(path for pattern in patterns for path in sorted(self.output.glob(pattern))))
        groups = in_order(group_name(row["dataset"]) for row in rows)
        groups.sort(key=lambda name: (name.startswith("objects"), name in ("apartment", "room")))  # real scenes first
        return {name: [row for row in rows if group_name(row["dataset"]) == name] for name in groups}

    def _memory(self):
        """data set -> method -> (bytes by the paper's formula, bytes measured)."""
        memory = {}
        for path in sorted(self.output.glob("*/memory_*.csv")):
            for row in csv.DictReader(path.read_text().splitlines()):
                figures = (int(row["paper_bytes"]), int(row["memory_bytes"]))
                memory.setdefault(row["dataset"], {})[row["method"]] = figures
        return memory

    def report(self, dataset, name):
        """Figures of a map's build; `dataset` may name a group."""
        path = self.output / dataset.split(":")[-1] / f"{name}.json"
        return json.loads(path.read_text()) if path.exists() else None

    def map_file_bytes(self, dataset, name):
        path = self.output / dataset.split(":")[-1] / f"{name}.ttsdf"
        return path.stat().st_size if path.exists() else None

    def run_facts(self):
        path = self.output / "run.json"
        return json.loads(path.read_text()) if path.exists() else {}
