#!/usr/bin/python3
"""Parts of scripts/ttsdf_results: known logs in, known figures out; steps run once; what makes a page out of date."""

import json
import math
import pathlib
import sys
import tempfile
import unittest

import numpy as np

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
from ttsdf_results import check, code, comparison_page, figures, logs, protocol, scenes, small_cloud, store  # noqa: E402

HEADER = ("dataset,method,scan,kind,magnitude,direction,translation_error,rotation_error,accepted,reason,iterations,ms,cpu_ms,"
          "dx,dy,dz,mahalanobis_squared,confidence")


def line(method, error, magnitude=0.1, kind="translation", accepted=1, distance="nan", n=0):
    return f"kitchen,{method},scan{n},{kind},{magnitude},{n},{error},{error / 10},{accepted},converged,3,2,2,0,0,0,{distance},nan"


class FolderTest(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="ttsdf_results_")
        self.folder = pathlib.Path(self._folder.name)

    def tearDown(self):
        self._folder.cleanup()

    def log(self, lines, tail=""):
        path = self.folder / "log.csv"
        path.write_text("\n".join([HEADER, *lines]) + "\n" + tail)
        return logs.read_log(path)


class Logs(FolderTest):
    def test_wrong_answers_count_only_when_accepted_and_medians_are_those_of_successes(self):
        rows = self.log([line("ours", 0.01, distance=2), line("ours", 0.02, distance=20), line("ours", 0.5, distance=1e4),
                         line("ours", 0.7, accepted=0, distance=1e5)], tail="kitchen,ours,cut o")
        cell = logs.condense(rows)
        self.assertEqual((cell.runs, cell.success, cell.accepted_wrong), (4, 0.5, 0.25))
        self.assertAlmostEqual(cell.translation[1], 0.015)
        self.assertAlmostEqual(cell.translation_of_all[1], 0.26)
        self.assertAlmostEqual(cell.consistent, 1 / 3)  # rejected answers promise nothing
        self.assertEqual(cell.mahalanobis, 20)

    def test_methods_without_covariance_have_no_consistency(self):
        self.assertTrue(math.isnan(logs.condense(self.log([line("ICP", 0.01)])).consistent))

    def test_a_bad_row_is_named(self):
        with self.assertRaisesRegex(logs.LogError, "line 2"):
            self.log(["kitchen,ours,scan,translation,far,0,1,1,1,x,1,1,1,0,0,0,nan,nan"])


class Store(FolderTest):
    def setUp(self):
        super().setUp()
        tools = self.folder / "tools"
        tools.mkdir()
        tool = tools / "count"
        tool.write_text('#!/bin/sh\necho run >> "$2/runs"\n[ "$1" != fail ] || { echo "count: error: no" >&2; exit 1; }\n')
        tool.chmod(0o755)
        self.store = store.Store(self.folder / "store", tools)

    def runs(self, step):
        return len((self.store.run(step) / "runs").read_text().splitlines())

    def test_a_step_runs_once_and_again_when_its_command_changes(self):
        step = store.Step("a", ["count", "x", store.OUT])
        self.assertEqual((self.runs(step), self.runs(step)), (1, 1))
        other = store.Step("a", ["count", "y", store.OUT])
        self.assertNotEqual(self.store.path(step), self.store.path(other))

    def test_a_step_runs_again_when_what_it_uses_changes(self):
        def after(word):
            return store.Step("b", ["count", store.Step("a", ["count", word, store.OUT]), store.OUT])
        self.assertNotEqual(self.store.path(after("x")), self.store.path(after("y")))

    def test_an_interrupted_step_goes_on_in_its_folder(self):
        step = store.Step("a", ["count", "x", store.OUT])
        part = self.store.path(step).with_name(self.store.path(step).name + ".part")
        part.mkdir(parents=True)
        (part / "runs").write_text("run\n")
        self.assertEqual(self.runs(step), 2)

    def test_a_failed_step_says_why_and_is_not_done(self):
        step = store.Step("a", ["count", "fail", store.OUT])
        with self.assertRaisesRegex(store.StepError, "count: error: no"):
            self.store.run(step)
        self.assertFalse(self.store.is_done(step))


class Code(FolderTest):
    def digest(self, text):
        (self.folder / "src" / "field").mkdir(parents=True, exist_ok=True)
        (self.folder / "src" / "field" / "a.cpp").write_text(text)
        code.folder_digest.cache_clear()
        return code.folder_digest("field", self.folder)

    def tearDown(self):
        code.folder_digest.cache_clear()
        super().tearDown()

    def test_comments_and_line_breaks_change_nothing_and_code_does(self):
        before = self.digest('int a = 1;  // one\nconst char* s = "// no comment";\n')
        self.assertEqual(before, self.digest('/* new */ int a =\n    1;\nconst char* s = "// no comment";'))
        self.assertNotEqual(before, self.digest('int a = 2;\nconst char* s = "// no comment";'))
        self.assertNotEqual(before, self.digest('int a = 1;\nconst char* s = "// another";'))

    def test_every_part_names_folders_that_exist(self):
        for folder in code.folders(code.PARTS):
            self.assertTrue(list(code.files_of(folder)), folder)

    def test_a_page_is_out_of_date_when_its_code_changed(self):
        facts = {"commit": "abc", "code": {"register": code.digest(("register",))}}
        (self.folder / "page.md").write_text("")
        (self.folder / "page.json").write_text(json.dumps(facts))
        self.assertEqual(list(check.outdated(self.folder)), [])
        facts["code"]["register"] = "older"
        (self.folder / "page.json").write_text(json.dumps(facts))
        self.assertEqual(list(check.outdated(self.folder)), [("page.md", "abc", ["register"])])
        (self.folder / "other.md").write_text("")
        self.assertEqual(check.unaccounted(self.folder), ["other.md"])


class Scenes(unittest.TestCase):
    def test_no_scan_is_a_frame_of_the_map(self):
        for scene in scenes.SCENES:
            for count in (1, 3, 5, 20, 1000):
                every, offset = scene.scan_selection(count)
                scans = {n for n in range(scene.last) if n % every == offset}
                mapped = {n for n in range(scene.last) if n % scene.mapped[0] == scene.mapped[1]}
                self.assertTrue(scans, scene.name)
                self.assertFalse(scans & mapped, scene.name)

    def test_missing_data_is_left_out_by_name_and_simulation_stays(self):
        there, missing = scenes.available(None)
        self.assertTrue(all(scene.simulated for scene in there))
        self.assertIn("redkitchen", missing)

    def test_every_step_that_is_needed_comes_first(self):
        room = next(s for s in scenes.SCENES if s.name == "room")
        chain = protocol.steps_of(room, "", protocol.PAPER_SWEEP).chain()
        for n, step in enumerate(chain):
            for need in step.needs():
                self.assertTrue(any(need is other for other in chain[:n]), step.name)


class SmallCloud(unittest.TestCase):
    def test_a_cell_has_the_mean_of_its_points(self):
        points = np.array([[0.01, 0.0, 0.0], [0.03, 0.0, 0.0], [-0.01, 0.0, 0.0]])
        self.assertEqual(sorted(np.round(small_cloud.averaged(points, 0.05)[:, 0], 9)), [-0.01, 0.02])


class Page(FolderTest):
    def scene(self, ours, other):
        rows = self.log([line("ours_r40", e, distance=3, n=n) for n, e in enumerate(ours)]
                        + [line("ours_r60", e, distance=3, n=n) for n, e in enumerate(ours)]
                        + [line("GICP", e, n=n) for n, e in enumerate(other)])
        return {"what": "a kitchen", "scans": 4, "maps": {}, "parts": {"ours": figures.sweep_figures(rows, {})}}

    def limits(self, ours, other):
        scene = self.scene(ours, other)
        return list(comparison_page.behind("kitchen", scene)), list(comparison_page.untrusted({"kitchen": scene}))

    def test_where_another_method_is_ahead_is_said(self):
        behind, doubt = self.limits([0.01, 0.01, 0.01, 0.4], [0.005] * 4)
        self.assertIn(["kitchen", "success [%]", "75.0", "GICP 100.0"], behind)
        self.assertIn(["kitchen", "median translation [mm]", "10.0", "GICP 5.0"], behind)
        self.assertEqual(doubt[0][:3], ["kitchen", "ours_r40", "25.0"])

    def test_confidence_is_held_against_what_came_true(self):
        rows = self.log([line("ours_r40", e, n=n).replace(",nan", ",0.97") for n, e in enumerate([0.01, 0.01, 0.01, 0.4])])
        self.assertEqual(rows[0]["confidence"], 0.97)
        self.assertIn("| 0.95 to 0.99 | 4 | 75.0 |", comparison_page.reliability_section({"kitchen": rows}))

    def test_where_none_is_ahead_nothing_is_said(self):
        self.assertEqual(self.limits([0.01] * 4, [0.02, 0.4, 0.4, 0.4]), ([], []))


if __name__ == "__main__":
    unittest.main(verbosity=2)
