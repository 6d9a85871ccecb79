#!/usr/bin/python3
"""Runs `scripts/evaluate --quick` on simulated data: from nothing to the page, and again without running anything twice.

Needs the built tools; TTSDF_BUILD_DIR names their build folder.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
import evaluation_data  # noqa: E402


def evaluate(output, *arguments):
    return subprocess.run([str(SCRIPTS / "evaluate"), "--quick", "--output", str(output), *arguments],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, timeout=580)


class Quick(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls._folder = tempfile.TemporaryDirectory(prefix="ttsdf_evaluate_")
        cls.output = pathlib.Path(cls._folder.name) / "output"
        cls.result = evaluate(cls.output)

    @classmethod
    def tearDownClass(cls):
        cls._folder.cleanup()

    def setUp(self):
        self.assertEqual(self.result.returncode, 0, self.result.stdout)
        self.evaluation = evaluation_data.Evaluation(self.output)

    def test_page_holds_every_method(self):
        text = (self.output / "page" / "README.md").read_text()
        for method in ("ours", "ours_search", "ours_not_compressed", "ours_global", "TT-SDF2PC", "TT-TSDF", "SDF2PC",
                       "TSDF2PC", "ICP", "ICP_plane", "GICP", "NDT", "FPFH_RANSAC", "FPFH_FGR", "TEASER++"):
            self.assertIn(method, text)
        self.assertNotIn(str(self.output), text)

    def test_prior_scores_exactly_the_perturbation(self):
        for rows in self.evaluation.local.values():
            for row in (row for row in rows if row["method"] == "prior"):
                error = row["translation_error" if row["kind"] == "translation" else "rotation_error"]
                self.assertAlmostEqual(error, row["magnitude"], places=6)

    def test_ours_finds_the_room_and_the_chair_from_every_perturbation(self):
        for group, rows in self.evaluation.local.items():
            sweep = evaluation_data.Sweep(rows)
            for (method, kind, magnitude), cell in sweep.cells.items():
                if method == "ours_search":
                    self.assertEqual(cell.success, 1.0, f"{group}, {magnitude} {kind}")

    def test_fields_that_were_not_compressed_are_as_large_as_their_grid(self):
        for memory in self.evaluation.memory.values():
            if "SDF2PC" in memory and "TT-SDF2PC" in memory:
                self.assertGreater(memory["SDF2PC"][0], 3 * memory["TT-SDF2PC"][0])

    def test_again_runs_nothing(self):
        again = evaluate(self.output)
        self.assertEqual(again.returncode, 0, again.stdout)
        self.assertRegex(again.stdout, r"\b([1-9]\d*) of \1 steps were done before")
        self.assertNotIn("left", again.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
