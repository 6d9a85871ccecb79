#!/usr/bin/python3
"""Runs `scripts/evaluate --quick` on a simulated room: from nothing to the table, and again without running anything twice.

Needs the built tools; TTSDF_BUILD_DIR names their build folder.
"""

import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"


def evaluate(store, *arguments):
    return subprocess.run([str(SCRIPTS / "evaluate"), "--quick", "--scenes", "room", "--store", str(store), *arguments],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, timeout=580)


class Quick(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls._folder = tempfile.TemporaryDirectory(prefix="ttsdf_evaluate_")
        cls.store = pathlib.Path(cls._folder.name) / "store"
        cls.result = evaluate(cls.store, "--page", cls._folder.name + "/page")

    @classmethod
    def tearDownClass(cls):
        cls._folder.cleanup()

    def setUp(self):
        self.assertEqual(self.result.returncode, 0, self.result.stderr)

    def test_table_has_every_method_and_ours_finds_the_room(self):
        lines = {line.split()[0]: line for line in self.result.stdout.splitlines() if line[:1].isalpha()}
        for method in ("ours_r60", "ours_r40", "GICP"):
            self.assertIn(method, lines)
        success = {method: [int(word) for word in lines[method].split()[2:6]] for method in ("ours_r60", "GICP")}
        for ours, other in zip(success["ours_r60"], success["GICP"]):
            self.assertGreaterEqual(ours, 80, lines)  # one of the five scans sees a single wall

    @unittest.skipUnless(os.environ.get("TTSDF_TEST_DATA"), "TTSDF_TEST_DATA names no folder with the public sequences")
    def test_a_scan_of_which_most_is_not_mapped_is_found_from_half_a_metre(self):
        result = evaluate(self.store, "--no-clouds", "--scenes", "icl_nuim")
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = [line for line in result.stdout.splitlines() if line.startswith("ours")]
        self.assertEqual(len(lines), 2, result.stdout)
        for line in lines:
            success = [int(word) for word in line.split()[2:6]]
            # Two scans and four perturbations; the far field alone finds five of the eight.
            self.assertGreaterEqual(sum(success), 350, line)

    def test_page_has_the_scene_and_no_folder_of_this_machine(self):
        page = (pathlib.Path(self._folder.name) / "page" / "README.md").read_text()
        self.assertIn("## room", page)
        self.assertNotIn(self._folder.name, page)
        self.assertTrue((pathlib.Path(self._folder.name) / "page" / "limits.md").exists())

    def test_again_runs_nothing(self):
        again = evaluate(self.store)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertNotRegex(again.stderr, r"room/\S+: \d+ s")
        self.assertIn("ours_r60", again.stdout)

    def test_unknown_scene_is_named(self):
        result = evaluate(self.store, "--scenes", "attic")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("attic", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
