#!/usr/bin/python3
"""Tests of scripts/evaluate's parts: known logs in, known tables and verdicts out; data sets found; steps resumed."""

import contextlib
import importlib.machinery
import importlib.util
import io
import json
import pathlib
import sys
import tempfile
import unittest

import numpy as np

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
import evaluation_data  # noqa: E402
import evaluation_page  # noqa: E402
import evaluation_plan as planning  # noqa: E402
import evaluation_verdict  # noqa: E402


def load_script(name):
    loader = importlib.machinery.SourceFileLoader("script_" + name, str(SCRIPTS / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


HEADER = ("dataset,method,scan,kind,magnitude,direction,translation_error,rotation_error,accepted,reason,iterations,ms,"
          "cpu_ms,dx,dy,dz")


def rows(dataset, method, kind, magnitude, errors, cpu_ms):
    """Rotation errors are a tenth of the translation errors."""
    return [f"{dataset},{method},scan{n % 2},{kind},{magnitude:g},{n},{e},{e / 10},1,converged,3,{cpu_ms},{cpu_ms},0,0,0"
            for n, e in enumerate(errors)]


def write_log(path, lines, tail=""):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([HEADER, *lines]) + "\n" + tail)


class FolderTest(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="ttsdf_evaluation_")
        self.folder = pathlib.Path(self._folder.name)

    def tearDown(self):
        self._folder.cleanup()


class Page(FolderTest):
    """Ours: better from 0.1 m, behind ICP in success from 0.5 m and in the median from 0.05 rad."""

    def setUp(self):
        super().setUp()
        self.output = self.folder / "output"
        fields = (rows("kitchen", "ours", "translation", 0.1, [0.010, 0.012, 0.014, 0.9], 2.0)
                  + rows("kitchen", "ours", "translation", 0.5, [0.010, 0.9, 0.9, 0.9], 2.0)
                  + rows("kitchen", "ours", "rotation", 0.05, [0.020, 0.020, 0.020, 0.020], 2.0))
        clouds = (rows("kitchen", "ICP", "translation", 0.1, [0.02, 0.03, 0.9, 0.9], 100.0)
                  + rows("kitchen", "ICP", "translation", 0.5, [0.02, 0.02, 0.9, 0.9], 100.0)
                  + rows("kitchen", "ICP", "rotation", 0.05, [0.0101, 0.0101, 0.0101, 0.0101], 100.0))
        write_log(self.output / "kitchen" / "fields_scans.csv", fields, tail="kitchen,ours,sca")
        write_log(self.output / "kitchen" / "clouds_scans.csv", clouds)
        write_log(self.output / "kitchen" / "global_scans.csv",
                  rows("kitchen", "FPFH_FGR", "translation", 1.0, [0.2, 0.3, 0.4], 50.0))
        write_log(self.output / "kitchen" / "ranks" / "sweep.csv",
                  rows("ranks:kitchen", "ours R10", "translation", 0.1, [0.03] * 4, 1.0)
                  + rows("ranks:kitchen", "ours R40", "translation", 0.1, [0.01] * 4, 1.0))
        (self.output / "kitchen" / "ours.ttsdf").write_bytes(bytes(50000))
        (self.output / "kitchen" / "memory_fields_scans.csv").write_text(
            "dataset,method,paper_bytes,memory_bytes\nkitchen,ours,840000,19000000\n")
        (self.output / "kitchen" / "memory_clouds_scans.csv").write_text(
            "dataset,method,paper_bytes,memory_bytes\nkitchen,ICP,300000,800000\n")
        (self.output / "run.json").write_text(json.dumps({"command": "scripts/evaluate --data DATA/kitchen",
                                                          "commit": "abc1234", "machine": "a machine"}))

    def write(self):
        self.page = evaluation_page.write(self.output, self.folder / "page")
        return self.page.read_text()

    def test_quartiles_and_success_are_those_of_the_log(self):
        sweep = evaluation_data.Sweep(evaluation_data.Evaluation(self.output).local["kitchen"])
        cell = sweep.cell("ours", "translation", 0.1)
        self.assertEqual(cell.runs, 4)
        self.assertEqual(cell.success, 0.75)
        self.assertTrue(np.allclose(cell.translation, (0.0115, 0.013, 0.2355)))
        self.assertTrue(np.allclose(cell.rotation, (0.00115, 0.0013, 0.02355)))
        self.assertEqual(sweep.times, {"ours": 2.0, "ICP": 100.0})
        self.assertEqual(sweep.scans, 2)

    def test_page_has_the_figures_the_run_and_the_pictures(self):
        text = self.write()
        for wanted in ("abc1234", "a machine", "scripts/evaluate --data DATA/kitchen", "| **75** | **25** | **100** |",
                       "| ICP | 50 | 50 | 100 |", "| **13.0 / 1.3** | **900 / 90.0** | **20.0 / 2.0** |",
                       "| kitchen | FPFH_FGR | 3 | 0 | 300 (250-350) | 30.0 | 50 |", "**50 kB**", "640 kB",
                       "| ours | 10 |  | 100 | 30.0 / 3.0 |"):
            self.assertIn(wanted, text)
        for picture in ("kitchen_errors.png", "kitchen_ranks.png"):
            self.assertIn(f"]({picture})", text)
            self.assertGreater((self.page.parent / picture).stat().st_size, 5000)
        self.assertNotIn(str(self.folder), text)

    def test_page_says_where_ours_is_behind_and_nowhere_else(self):
        text = self.write()
        behind = [line for line in text.split("\n## ")[1].splitlines() if line.startswith("| kitchen")]
        self.assertEqual(behind, [
            "| kitchen | success | 0.5 m | 25 % | ICP 50 % |",
            "| kitchen | median translation | 0.5 m, 0.05 rad | 20.0 mm | ICP 10.1 mm |",
            "| kitchen | median rotation | 0.5 m, 0.05 rad | 2.0 mrad | ICP 1.0 mrad |",
            "| kitchen | map in memory |  | 19000 kB | ICP 800 kB |"])
        self.assertIn("kitchen 2 of 3", text)

    def test_a_peer_that_mostly_fails_has_no_median_to_be_behind_of(self):
        lines = (rows("k", "ours", "rotation", 0.1, [0.02] * 4, 1.0)
                 + rows("k", "NDT", "rotation", 0.1, [0.001, 0.9, 0.9, 0.9], 1.0))
        write_log(self.folder / "k.csv", lines)
        sweep = evaluation_data.Sweep(evaluation_data.read_log(self.folder / "k.csv"))
        self.assertEqual(evaluation_verdict.compare_group("k", sweep)[2], [])

    def test_a_slower_method_is_told(self):
        lines = rows("k", "ours", "rotation", 0.1, [0.02], 5.0) + rows("k", "GICP", "rotation", 0.1, [0.02], 4.0)
        write_log(self.folder / "k.csv", lines)
        sweep = evaluation_data.Sweep(evaluation_data.read_log(self.folder / "k.csv"))
        self.assertEqual(evaluation_verdict.compare_group("k", sweep)[2],
                         [("k", "all", "time per scan", "5 ms", "GICP 4 ms", 0.0)])

    def test_methods_are_judged_by_the_same_perturbations(self):
        clouds = self.output / "kitchen" / "clouds_scans.csv"
        lines = clouds.read_text().splitlines()
        clouds.write_text("\n".join(lines[:3] + lines[5:]) + "\n")  # ICP never got to the last two of 0.1 m
        sweep = evaluation_data.Sweep(evaluation_data.Evaluation(self.output).local["kitchen"])
        self.assertEqual(sweep.cell("ours", "translation", 0.1).runs, 2)
        self.assertEqual(sweep.cell("ours", "translation", 0.1).success, 1.0)
        self.assertEqual(sweep.cell("ours", "translation", 0.5).runs, 4)

    def test_a_model_that_a_method_never_reached_is_left_out_for_all(self):
        for model, methods in (("chair", ("ours", "ICP")), ("stool", ("ours",))):
            write_log(self.output / model / "fields_none.csv",
                      [line for method in methods
                       for line in rows(f"objects-exact:{model}", method, "translation", 0.1, [0.01, 0.02], 1.0)])
        sweep = evaluation_data.Sweep(evaluation_data.Evaluation(self.output).local["objects-exact"])
        self.assertEqual(sweep.cell("ours", "translation", 0.1).runs, 2)
        self.assertEqual(sweep.cell("ICP", "translation", 0.1).runs, 2)

    def test_models_of_a_sensor_are_one_group(self):
        for model in ("chair", "stool"):
            write_log(self.output / model / "fields_none.csv",
                      rows(f"objects-exact:{model}", "ours", "translation", 0.1, [0.01, 0.02], 1.0))
        groups = evaluation_data.Evaluation(self.output).local
        self.assertEqual(list(groups), ["kitchen", "objects-exact"])
        self.assertEqual(evaluation_data.Sweep(groups["objects-exact"]).cell("ours", "translation", 0.1).runs, 4)

    def test_a_broken_log_is_named_with_its_line(self):
        write_log(self.output / "kitchen" / "clouds_scans.csv", ["kitchen,ICP,s,translation,0.1,0,bad,0,1,x,1,1,1,0,0,0"])
        with self.assertRaisesRegex(evaluation_page.PageError, "clouds_scans.csv, line 2"):
            self.write()

    def test_no_logs_are_no_page(self):
        with self.assertRaisesRegex(evaluation_page.PageError, "no logs"):
            evaluation_page.write(self.folder / "nothing", self.folder / "page")


class Plan(FolderTest):
    def frames(self, name, count):
        folder = self.folder / name
        folder.mkdir()
        for n in range(count):
            (folder / f"frame-{n:06d}.depth.png").touch()
        return folder

    def test_finds_every_layout(self):
        kitchen = self.frames("kitchen", 3)
        (kitchen / "gravity-direction.txt").write_text("0.0\n0.9\n0.4\n")
        (self.folder / "models").mkdir()
        (self.folder / "models" / "chair.off").touch()
        tum = self.folder / "tum"
        (tum / "depth").mkdir(parents=True)
        for name in ("depth.txt", "groundtruth.txt", "depth/1.png"):
            (tum / name).touch()
        found = planning.find_data(self.folder, self.folder / "out")
        self.assertEqual([d.name for d in found], ["kitchen", "chair", "tum"])
        self.assertEqual(found[0].down, "0.0,0.9,0.4")
        self.assertEqual(found[2].depth_scale, 5000.0)
        self.assertEqual(found[2].prepare[0].command[:2], ["@frames_from", "tum"])

    def test_intrinsics_beside_the_sequences_are_linked_to_them(self):
        scene = self.folder / "scene"
        scene.mkdir()
        self.frames("scene/seq-01", 2)
        (scene / "camera-intrinsics.txt").write_text("K")
        for _ in range(2):  # a second call finds the links
            found = planning.find_data(scene, self.folder / "out")
        self.assertEqual([d.name for d in found], ["scene_seq-01"])
        self.assertEqual((found[0].frames / "camera-intrinsics.txt").read_text(), "K")
        self.assertEqual(found[0].indices, [0, 1])
        self.assertTrue((found[0].frames / "frame-000001.depth.png").exists())

    def test_nothing_known_is_an_error(self):
        for bad in (self.folder, self.folder / "absent"):
            with self.assertRaises(planning.PlanError):
                planning.find_data(bad, self.folder)

    def test_scans_lie_half_way_between_mapped_frames_and_are_few(self):
        for count in (1000, 200, 60, 50, 5):
            scene = planning.Scene("s", self.folder, indices=list(range(count)))
            every, scan_every, offset = planning.frame_selection(scene, planning.Selection())
            mapped = [n for n in range(count) if n % every == 0]
            scans = [n for n in range(count) if n % scan_every == offset]
            self.assertTrue(mapped and scans, count)
            self.assertFalse(set(mapped) & set(scans), count)
            self.assertLessEqual(len(scans), 20 + 1, count)

    def test_every_map_of_a_sweep_is_built_before(self):
        scene = planning.Scene("s", self.folder, indices=list(range(100)))
        model = planning.Model("m", self.folder / "m.off")
        made = set()
        for step in planning.whole_plan([scene, model], self.folder / "out", planning.Selection()):
            words = " ".join(map(str, step.command)).replace("=", " ").replace(",", " ").replace(":", " ").split()
            needed = [w for w in words if w.endswith((".ttsdf", ".vdb")) and w not in map(str, step.makes)]
            self.assertFalse([w for w in needed if w not in made], step.title)
            made.update(map(str, step.makes))

    def test_two_data_sets_of_one_name_are_refused(self):
        model = planning.Model("m", self.folder / "m.off")
        with self.assertRaisesRegex(planning.PlanError, "two data sets"):
            planning.whole_plan([model, model], self.folder, planning.Selection())

    def test_the_chair_is_a_closed_mesh(self):
        planning.write_chair(self.folder / "chair.off")
        words = (self.folder / "chair.off").read_text().split()
        vertices, faces = int(words[1]), int(words[2])
        points = np.array(words[4:4 + 3 * vertices], dtype=float).reshape(-1, 3)
        quads = np.array(words[4 + 3 * vertices:], dtype=int).reshape(faces, 5)[:, 1:]
        edges = {(a, b) for quad in quads for a, b in zip(quad, np.roll(quad, -1))}
        self.assertEqual(len(edges), 4 * faces)  # no edge twice in one direction ...
        self.assertTrue(all((b, a) in edges for a, b in edges))  # ... and each once in the other
        p = points[quads]
        volume = np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2]) + np.cross(p[:, 2], p[:, 3])) / 6
        self.assertGreater(volume, 0.0)  # counter-clockwise seen from outside


class Steps(FolderTest):
    def setUp(self):
        super().setUp()
        self.evaluate = load_script("evaluate")
        self.tools = self.folder / "tools"
        self.tools.mkdir()
        (self.tools / "count").write_text('#!/bin/sh\necho run >> "$1"\n')
        (self.tools / "fail").write_text('#!/bin/sh\necho first >&2\necho "error: got 1, wanted 2" >&2\nexit 1\n')
        for tool in self.tools.iterdir():
            tool.chmod(0o755)
        self.made = self.folder / "made"

    def run_steps(self, *steps):
        runner = self.evaluate.Runner(self.tools, self.folder)
        with contextlib.redirect_stdout(io.StringIO()) as out:
            self.evaluate.run_all(runner, list(steps), 2)
        return out.getvalue()

    def step(self, *more):
        return planning.Step("data: step", ["count", self.made, *more], [self.made])

    def test_a_step_that_was_done_is_not_run_again_unless_it_changed(self):
        self.run_steps(self.step())
        self.assertIn("1 of 1 steps were done before", self.run_steps(self.step()))
        self.assertEqual(self.made.read_text(), "run\n")
        self.run_steps(self.step("--other"))
        self.assertEqual(self.made.read_text(), "run\nrun\n")

    def test_a_step_whose_file_is_gone_is_run_again(self):
        self.run_steps(self.step())
        self.made.unlink()
        self.run_steps(self.step())
        self.assertTrue(self.made.exists())

    def test_a_failure_is_named_ends_the_run_and_is_not_done(self):
        failing = planning.Step("data: bad", ["fail"], [])
        with self.assertRaisesRegex(self.evaluate.StepError, "data: bad: error: got 1, wanted 2"):
            self.run_steps(failing, self.step())
        self.assertFalse(self.made.exists())
        with self.assertRaises(self.evaluate.StepError):
            self.run_steps(failing)


if __name__ == "__main__":
    unittest.main(verbosity=2)
