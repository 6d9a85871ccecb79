#!/usr/bin/python3
"""Tests of scripts/registration_report's parts: known logs in, known figures out."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from PIL import Image

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
import evaluation_data  # noqa: E402
import poses  # noqa: E402
import registration_data as data  # noqa: E402
import registration_page  # noqa: E402
import registration_plan  # noqa: E402


class FolderTest(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="ttsdf_registration_")
        self.folder = pathlib.Path(self._folder.name)

    def tearDown(self):
        self._folder.cleanup()


class Benchmarks(FolderTest):
    def test_medians_of_repetitions_in_seconds_and_families_that_rise(self):
        entry = {"run_type": "iteration", "cpu_time": 5.0}
        path = self.folder / "log.json"
        path.write_text(json.dumps({"benchmarks": [
            {**entry, "run_name": "overRank/rank:40/repeats:3", "time_unit": "ns", "cost": 9e-8},
            {**entry, "run_name": "overRank/rank:40/repeats:3", "run_type": "aggregate", "aggregate_name": "median",
             "time_unit": "ns", "cost": 4e-8},
            {**entry, "run_name": "overRank/rank:40/repeats:3", "run_type": "aggregate", "aggregate_name": "cv",
             "time_unit": "ns", "cost": 1.0},
            {**entry, "run_name": "overRank/rank:10", "time_unit": "ns", "cost": 2e-8},
            {**entry, "run_name": "scan/warm/iterations:1/repeats:21", "time_unit": "ms"}]}))
        found = data.read_benchmarks(path)
        self.assertEqual(sorted(found), ["overRank/rank:10", "overRank/rank:40", "scan/warm"])
        self.assertAlmostEqual(found["scan/warm"]["seconds"], 0.005)
        self.assertEqual(data.series(found, "overRank", "cost"), [(10, 2e-8), (40, 4e-8)])

    def test_what_is_no_log_is_refused(self):
        path = self.folder / "log.json"
        path.write_text("{}")
        self.assertRaises(evaluation_data.DataError, data.read_benchmarks, path)
        self.assertRaises(evaluation_data.DataError, data.series, {}, "overRank", "cost")


def row(method, scan, milliseconds, error=0.01, accepted="1"):
    return {"dataset": "d", "method": method, "scan": scan, "kind": "translation", "magnitude": 0.1, "direction": "0",
            "cpu_ms": milliseconds, "ms": milliseconds, "translation_error": error, "accepted": accepted}


class Sweeps(unittest.TestCase):
    def test_ratio_is_of_runs_from_the_same_prior(self):
        rows = [row("a", "1", 2.0), row("b", "1", 1.0), row("a", "2", 30.0), row("b", "2", 10.0), row("a", "3", 9.0)]
        self.assertAlmostEqual(data.paired_ratio(rows, "a", "b"), 2.5)
        self.assertRaises(evaluation_data.DataError, data.paired_ratio, rows, "a", "c")

    def test_answers_from_another_place_are_wrong_when_accepted(self):
        rows = [row("g", "1", 1000.0), row("g", "2", 3000.0, error=1.0), row("g", "3", 2000.0, error=1.0, accepted="0")]
        own, other = data.answers(rows), data.answers(rows, same_place=False)
        self.assertEqual((own.scans, own.near, own.accepted, own.wrong, own.refused), (3, 1, 2, 1, 1))
        self.assertEqual((other.near, other.wrong), (0, 2))
        self.assertEqual(own.seconds, (2.0, 3.0))


class Covariances(FolderTest):
    def test_a_right_covariance_passes_and_a_small_one_does_not(self):
        random = np.random.RandomState(1)
        root = random.normal(size=(6, 6))
        covariance = root @ root.T
        errors = random.normal(size=(4000, 6)) @ root.T
        right = data.consistency([data.Trial(e, covariance) for e in errors])
        self.assertAlmostEqual(right.mean_square, 6.0, delta=0.3)
        self.assertAlmostEqual(right.below_99, 0.99, delta=0.005)
        self.assertGreater(right.within.min(), 0.99)
        small = data.consistency([data.Trial(e, covariance / 4.0) for e in errors])
        self.assertAlmostEqual(small.mean_square, 24.0, delta=1.2)
        self.assertLess(small.within.max(), 0.9)

    def test_errors_are_from_the_estimate_to_the_truth_about_the_sensor(self):
        batch = self.folder / "batch"
        batch.mkdir()
        R = poses.exp_so3([0.3, -0.2, 0.5])
        error = np.array([0.01, -0.02, 0.03, 0.1, 0.2, -0.3])
        np.savetxt(batch / "truth.txt", poses.pose(poses.exp_so3(error[:3]) @ R, [1.1, 2.2, 2.7]))
        (batch / "list.txt").write_text("a.bin prior.txt truth.txt\nb.bin prior.txt truth.txt\n")
        q = poses.quaternion_from_rotation(R)
        log = self.folder / "log.csv"
        log.write_text("scan,success,tx,ty,tz,qx,qy,qz,qw\na.bin,1,1,2,3," + ",".join(map(repr, map(float, q)))
                       + "\nb.bin,0,0,0,0,0,0,0,1\n")
        names = [f"c{a}{b}" for a in range(6) for b in range(6)]
        (self.folder / "log_uncertainty.csv").write_text(
            "scan,weak_directions," + ",".join(names) + "\na.bin,2," + ",".join(map(str, np.diag(range(1, 7)).ravel()))
            + "\nb.bin," + "," * 36 + "\n")
        trials, weak, scans = data.read_uncertainty(log, batch)
        self.assertEqual((len(trials), weak, scans), (1, [2], 2))
        np.testing.assert_allclose(trials[0].error, error, atol=1e-9)
        np.testing.assert_allclose(np.diag(trials[0].covariance), range(1, 7))


class Bars(unittest.TestCase):
    def test_missed_bars_are_named(self):
        self.assertTrue(registration_page.Bar("time", 2.0, "<=", 3.0).kept)
        missed = registration_page.Bar("share", 94.0, ">=", 95.0, "%")
        self.assertFalse(missed.kept)
        self.assertEqual(missed.row(), ["share", "94 %", ">= 95 %", "**missed**"])


class Plan(unittest.TestCase):
    def test_rounds_never_meet_a_mapped_frame_or_each_other(self):
        for wanted in (1, 4, 20, 100):
            step = 10 * registration_plan.thinned(100, wanted)
            chosen = [{index for index in range(1000) if index % (4 * step) == 5 + n * step} for n in range(4)]
            self.assertEqual(sum(map(len, chosen)), len(set.union(*chosen)))
            self.assertTrue(all(index % 10 == 5 for index in set.union(*chosen)))


class FramesToBatch(FolderTest):
    def test_points_and_priors(self):
        frames, output = self.folder / "frames", self.folder / "batch"
        frames.mkdir()
        np.savetxt(frames / "camera-intrinsics.txt", [[500, 0, 4], [0, 500, 3], [0, 0, 1]])
        depth = np.full((6, 8), 2000, dtype=np.uint16)
        depth[0, 0] = 0
        Image.fromarray(depth).save(frames / "frame-000003.depth.png")
        truth = poses.pose(poses.exp_so3([0.1, 0.2, 0.3]), [1, 2, 3])
        np.savetxt(frames / "frame-000003.pose.txt", truth)
        subprocess.run([str(SCRIPTS / "frames_to_batch"), str(frames), str(output), "--stride", "2", "--move", "0.5",
                        "--turn", "0.2"], check=True, timeout=60)
        self.assertEqual((output / "list.txt").read_text(), "scan-000003.bin prior-000003.txt truth-000003.txt\n")
        points = np.fromfile(output / "scan-000003.bin", dtype="<f4").reshape(-1, 3)
        self.assertEqual(len(points), 3 * 4 - 1)
        np.testing.assert_allclose(points[0], [-2 * 2 / 500, -3 * 2 / 500, 2], rtol=1e-6)
        np.testing.assert_allclose(np.loadtxt(output / "truth-000003.txt"), truth, atol=1e-9)
        moved = poses.inverse(truth) @ np.loadtxt(output / "prior-000003.txt")
        self.assertAlmostEqual(np.linalg.norm(moved[:3, 3]), 0.5)
        self.assertAlmostEqual(poses.rotation_angle(moved[:3, :3]), 0.2)


if __name__ == "__main__":
    unittest.main()
