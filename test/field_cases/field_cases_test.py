"""Files of public bug reports that failed once, each with the right value or the right message: by name, no signal, and no
more than five seconds without a word. usage: field_cases_test.py FOLDER-OF-THE-TOOLS VOLUMES-PROGRAM [unittest's options]

The files are made anew by remake.py. Where TTSDF_FIELD_CASES names a folder of cases, those are tried as well."""

import csv
import json
import os
import pathlib
import select
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
from PIL import Image

import remake

TOOLS, VOLUMES = sys.argv[1:3]
SILENCE = 5.0  # [s]
GIVEN = os.environ.get("TTSDF_FIELD_CASES")


def processor_time(pid):
    """Of a process and what it waited for [s]; None when it is gone. A busy machine must not look like a silent tool."""
    try:
        fields = pathlib.Path("/proc/%d/stat" % pid).read_text().rsplit(")", 1)[1].split()
    except OSError:
        return None
    return sum(int(word) for word in fields[11:15]) / os.sysconf("SC_CLK_TCK")


class Run:
    """One run of a tool: exit code, its words, and the longest time without any. It is stopped after `seconds`."""

    def __init__(self, tool, *arguments, folder=None, seconds=120.0):
        process = subprocess.Popen([os.path.join(TOOLS, tool)] + [str(a) for a in arguments], cwd=folder,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        started = said_when = time.monotonic()
        said_at, self.silence, self.stopped, words = 0.0, 0.0, False, b""
        while True:
            ready = select.select([process.stdout], [], [], 0.05)[0]
            used = processor_time(process.pid)
            if used is not None:
                self.silence = max(self.silence, min(used - said_at, time.monotonic() - said_when))
            if ready:
                said = os.read(process.stdout.fileno(), 1 << 16)
                if not said:
                    break
                words, said_when = words + said, time.monotonic()
                said_at = used if used is not None else said_at
            if time.monotonic() - started > seconds:
                self.stopped = True
                process.kill()
                break
        process.stdout.close()
        self.code, self.text = process.wait(), words.decode(errors="replace")


def build(*arguments, **options):
    return Run("ttsdf_build", *arguments, **options)


VOXELS = ("--voxel-size", 0.05, "--truncation", 0.15)
FINE = ("--every", 1, "--voxel-size", 0.04, "--truncation", 0.12)


class Cases:
    """What is right. Subclasses say where the files are: `case` gives a case's folder."""

    def setUp(self):
        self._work = tempfile.TemporaryDirectory(prefix="ttsdf_field_")
        self.work = pathlib.Path(self._work.name)
        self.out = self.work / "out.ttsdf"

    def tearDown(self):
        self._work.cleanup()

    def lives(self, run):
        self.assertGreaterEqual(run.code if not run.stopped else 0, 0, "ended by a signal\n" + run.text)
        self.assertLess(run.silence, SILENCE, run.text)
        return run

    def refuses(self, run, *words):
        self.lives(run)
        self.assertIn(run.code, (1, 2), run.text)
        for word in words:
            self.assertIn(word, run.text)
        self.assertFalse(self.out.exists())

    def is_box(self, run, offset=(0.0, 0.0, 0.0), within=0.001):
        """Distances of the map where the exact ones are known: on the middle of each side, and a little off it."""
        self.lives(run)
        self.assertEqual(run.code, 0, run.text)
        probes, truth = [], []
        for axis in range(3):
            for side in (-1.0, 1.0):
                for off in (-0.01, 0.0, 0.1):  # a voxel further in, distances are clamped
                    p = np.array([0.13, -0.11, 0.07])
                    p[axis] = side * (remake.HALF[axis] + off)
                    probes.append(p + offset)
                    truth.append(off)
        np.savetxt(self.work / "probes.txt", probes, fmt="%.9f")
        answer = self.lives(Run("ttsdf_query", self.out, "--points", self.work / "probes.txt"))
        rows = np.array([[float(word) for word in line.split()] for line in answer.text.splitlines()])
        self.assertTrue((rows[:, 4] > 0).all(), answer.text)
        np.testing.assert_allclose(rows[:, 0], truth, atol=within)
        self.out.unlink()

    def mesh(self, case, name, *more):
        return build("--mesh", self.case(case) / name, "--output", self.out, *VOXELS, *more)

    def is_room(self, run, folder, units=1000.0, right=lambda T: T):
        """The surface is right to 1 mm: where the images see it, most distances of the map are that small."""
        self.lives(run)
        self.assertEqual(run.code, 0, run.text)
        K = np.loadtxt(folder / "camera-intrinsics.txt")
        seen = []
        for stem in ("frame-000003", "frame-000017"):
            T = right(np.loadtxt(folder / (stem + ".pose.txt")))
            z = np.asarray(Image.open(folder / (stem + ".depth.png")))[4::9, 4::9] / units
            v, u = np.mgrid[4:120:9, 4:160:9]
            rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.shape)], axis=-1)
            seen.append((rays * z[..., None]).reshape(-1, 3) @ T[:3, :3].T + T[:3, 3])
        np.savetxt(self.work / "seen.txt", np.concatenate(seen))
        answer = Run("ttsdf_query", self.out, "--points", self.work / "seen.txt")
        rows = np.array([[float(word) for word in line.split()] for line in answer.text.splitlines()])
        known = rows[:, 4] > 0
        self.assertGreater(known.mean(), 0.8)
        self.assertLess(np.median(np.abs(rows[known, 0])), 0.001)
        self.out.unlink()

    def frames(self, folder, *more):
        return build("--frames", folder, "--output", self.out, *FINE, *more)

    def batch(self, lines):
        """Registers scans; (exit code's run, rows of the table)."""
        (self.work / "list.txt").write_text("".join(" ".join('"%s"' % word for word in line) + "\n" for line in lines))
        table = self.work / "out.csv"
        run = self.lives(Run("ttsdf_register", "--map", self.case("41-double-ply") / "room.ttsdf", "--batch",
                             self.work / "list.txt", "--output", table))
        with open(table, newline="") as file:
            return run, list(csv.DictReader(file))

    def scan_rows(self, case, *names):
        room = self.case("41-double-ply")
        return self.batch([(self.case(case) / name, room / "prior.txt", room / "truth.txt") for name in names])

    def found_or_refused(self, row):
        if row["success"] == "1":
            self.assertLess(float(row["translation_error"]), self.scan_within, row)

    def localize(self, case, name):
        """(run, summary, errors against the bag's own truth, or None)."""
        bag, summary, track = self.case(case) / name, self.work / "summary.json", self.work / "track.txt"
        run = self.lives(Run("offline_localizer", bag, "--map", self.case("41-double-ply") / "room.ttsdf", "--summary",
                             summary, "--trajectory", track))
        counts = json.loads(summary.read_text())
        if not counts["poses"]:
            return run, counts, None
        subprocess.run([str(remake.SCRIPTS / "evaluate_trajectory"), "%s:ground_truth" % bag, str(track), "--json",
                        str(self.work / "error.json")], check=True, stdout=subprocess.DEVNULL)
        return run, counts, json.loads((self.work / "error.json").read_text())

    def needs_bags(self):
        if not (remake.has_rosbag() and os.path.exists(os.path.join(TOOLS, "offline_localizer"))):
            self.skipTest("wanted rosbag and offline_localizer")

    def test_02_w2c(self):
        folder = self.case("02-w2c") / "w2c"
        self.refuses(self.frames(folder), "with the poses inverted", "--poses world-to-camera")
        self.is_room(self.frames(folder, "--poses", "world-to-camera"), folder, right=remake.poses.inverse)

    def test_04_scale(self):
        folder = self.case("04-scale") / "scale10000"
        self.refuses(self.frames(folder), "--depth-scale 10000")
        self.is_room(self.frames(folder, "--depth-scale", 10000), folder, 10000.0)

    def test_06_intrinsics(self):
        folder = self.case("06-intrinsics")
        self.refuses(self.frames(folder / "kcolor"), "principal point", "about 1298 x 970 pixels")
        self.refuses(self.frames(folder / "kvga"), "principal point", "about 639 x 479 pixels")
        self.refuses(self.frames(folder / "kneg"), "with the sign of fx changed", "--intrinsics 1")

    def test_08_points(self):
        for name in ("points_only.ply", "faces0.ply"):
            self.refuses(self.mesh("08-points", name), name, "8 vertices and no triangle", "--cloud")

    def test_10_mesh_segv(self):
        for name, words in (("bin_oob.ply", "vertex index 999999"), ("idx_oob.ply", "vertex index 99"),
                            ("idx_neg.ply", "vertex index -1"), ("bin_trunc.ply", "truncated"),
                            ("bin_trunc_half.ply", "truncated")):
            self.refuses(self.mesh("10-mesh-segv", name), name, words)
        self.is_box(self.mesh("10-mesh-segv", "bin_camera_first.ply"))

    def test_11_mesh_partial(self):
        self.refuses(self.mesh("11-mesh-partial", "ascii_trunc.ply"), "truncated", "of 12")
        for name in ("ref.ply", "strips.ply"):
            self.is_box(self.mesh("11-mesh-partial", name))

    def test_15_mesh_utm(self):
        for name in ("utm.obj", "utm_double.ply"):
            self.is_box(self.mesh("15-mesh-utm", name), remake.UTM)

    def test_16_no_end(self):
        case = self.case("16-no-end")
        stray = build("--mesh", case / "stray100.ply", "--output", self.out, *VOXELS, seconds=10.0)
        self.lives(stray)
        self.assertIn("3 of 11 vertices lie 99 m or more from the others", stray.text)
        self.out.unlink(missing_ok=True)
        for name, words in (("identity_xform.vdb", "1 m in its transform"), ("mm.vdb", "20 m in its transform"),
                            ("strayvoxel.vdb", "leaves of voxels lie")):
            self.refuses(build("--vdb", case / name, "--output", self.out), name, words, "--scale")
        self.is_box(build("--vdb", case / "mm.vdb", "--scale", 0.001, "--output", self.out))

    def test_16_tiny_mesh(self):
        for name, scale in (("tiny.ply", "1e5"), ("tiny6.ply", "1e6")):
            self.is_box(self.mesh("16-tiny-mesh", name, "--scale", scale))

    def test_22_rowstep(self):
        self.needs_bags()
        for name in ("c_row0.bag", "c_rowall.bag"):
            run, counts, error = self.localize("22-rowstep", name)
            self.assertEqual(run.code, 0, run.text)
            self.assertGreaterEqual(counts["poses"], counts["scans"] - 4)  # a start is confirmed before it counts
            self.assertLess(error["ate_translation"]["rmse"], self.bag_within)

    def test_25_binning_roi(self):
        self.needs_bags()
        for name in ("binning.bag", "roi.bag"):
            run, counts, error = self.localize("25-binning-roi", name)
            self.assertEqual(run.code, 0, run.text)
            self.assertEqual(counts["scans"], 60)
            self.assertGreaterEqual(counts["poses"], 58)
            self.assertLess(error["ate_translation"]["rmse"], self.bag_within)

    def test_29_zero_poses(self):
        self.needs_bags()
        run, counts, _ = self.localize("29-zero-poses", "nostatic.bag")
        self.assertEqual((run.code, counts["poses"]), (3, 0), run.text)
        for text in (run.text, counts["reason"]):
            self.assertIn("no transform 'camera_depth_optical_frame' -> 'base_link'", text)

    def test_38_device_output(self):
        mesh = self.case("38-device-output") / "ref.ply"
        os.mkfifo(self.work / "pipe")
        (self.work / "gone").symlink_to(self.work / "pipe")
        for name in ("pipe", "gone"):
            run = build("--mesh", mesh, "--output", self.work / name, *VOXELS)
            self.refuses(run, "got a pipe")
            self.assertTrue((self.work / name).is_fifo())
        (self.work / "other.ttsdf").write_text("")
        self.out.symlink_to(self.work / "other.ttsdf")
        self.is_box(build("--mesh", mesh, "--output", self.out, *VOXELS))
        self.assertGreater((self.work / "other.ttsdf").stat().st_size, 0)

    def test_41_double_ply(self):
        run, rows = self.scan_rows("41-double-ply", "o3d_double.ply", "double.pcd", "int16.pcd")
        self.assertIn("whole numbers for x y z", run.text)
        self.assertEqual([row["success"] for row in rows], ["1", "1", "0"])
        for row in rows:
            self.found_or_refused(row)

    def test_42_same_point(self):
        _, rows = self.scan_rows("42-same-point", "f64.bin", "same.pcd")
        self.assertEqual(rows[1]["success"], "0")
        self.assertNotEqual(rows[1]["reason"], "")
        self.found_or_refused(rows[0])

    def test_50_hostile_meshes(self):
        case = self.case("50-hostile")
        read = {"camera_list_first.ply"}
        for path in sorted(p for p in case.iterdir() if p.suffix in (".ply", ".off", ".obj")):
            run = build("--mesh", path, "--output", self.out, *VOXELS)
            if path.name in read:
                self.lives(run)
                self.assertEqual(run.code, 0, run.text)
                self.out.unlink()
            else:
                self.refuses(run, path.name)

    def test_50_hostile_scans(self):
        case = self.case("50-hostile")
        np.savetxt(self.work / "identity.txt", np.eye(4), fmt="%g")
        paths = sorted(p for p in case.iterdir() if p.suffix in (".ply", ".pcd"))
        run, rows = self.batch([(path, self.work / "identity.txt") for path in paths])
        self.assertEqual((run.code, len(rows)), (1, len(paths)), run.text)
        by_name = {path.name: row for path, row in zip(paths, rows)}
        for name, row in by_name.items():
            self.assertEqual(row["success"], "0", name)
        for name, count in (("d.ply", None), ("f.ply", None), ("dbl.ply", "2"), ("size8.pcd", "2")):
            self.assertNotEqual(by_name[name]["reason"], "unreadable", name)
            if count:
                self.assertEqual(by_name[name]["points"], count)
        self.assertEqual(by_name["d.ply"]["points"], by_name["f.ply"]["points"])
        for name in ("tx", "ty", "tz"):
            self.assertAlmostEqual(float(by_name["d.ply"][name]), float(by_name["f.ply"][name]), delta=1e-4)
        for name in ("uchar.ply", "int.pcd", "size3.pcd", "ascii_nan.pcd", "huge.ply", "list2.ply", "neg.pcd"):
            self.assertEqual(by_name[name]["reason"], "unreadable", name)

    def test_50_hostile_maps(self):
        for path in sorted(self.case("50-hostile").glob("*.ttsdf")):
            run = self.lives(Run("ttsdf_info", path))
            self.assertIn(run.code, (0, 1), run.text)
            if run.code == 1:
                self.assertIn(path.name, run.text)
            self.assertTrue(all(c.isprintable() or c == "\n" for c in run.text), "control characters of the file printed")

    def test_50_hostile_volumes(self):
        paths = sorted(self.case("50-hostile").glob("vdb_*.vdb"))
        self.assertGreaterEqual(len(paths), 2)
        for path in paths:
            run = self.lives(build("--vdb", path, "--output", self.out))
            if run.code == 0:  # a byte of a distance: one sample is off, none of the extent
                self.is_box(run, within=0.02)
            else:
                self.refuses(run, path.name)

    def test_50_hostile_options_and_images(self):
        case = self.case("50-hostile")
        for name, words in (("cycle.yaml", "alias"), ("deep.yaml", "nested deeper")):
            self.refuses(build("--mesh", case / "ascii_index.ply", "--output", self.out, "--config", case / name), name, words)
        for intrinsics, pose, words in (("intrinsics_cx_huge.txt", None, "principal point"),
                                        ("intrinsics_fx_0.001.txt", None, "fx 0.001"),
                                        (None, "pose_1e5_m.txt", "frame-000002"), (None, None, "16384")):
            folder = self.work / "frames"
            shutil.copytree(case / "frames", folder)
            for file in [folder] + list(folder.iterdir()):
                file.chmod(0o755)
            if intrinsics:
                shutil.copy(folder / intrinsics, folder / "camera-intrinsics.txt")
            elif pose:
                shutil.copy(folder / pose, folder / "frame-000002.pose.txt")
            else:
                shutil.copyfile(case / "zeros_16384.png", folder / "frame-000001.depth.png")
            run = self.lives(build("--frames", folder, "--output", self.out, "--every", 1))
            self.assertIn(words, run.text)
            if run.code == 0:
                self.out.unlink()
            shutil.rmtree(folder)


class Remade(Cases, unittest.TestCase):
    scan_within = bag_within = 0.02  # [m]: half a voxel
    made = {}

    @classmethod
    def setUpClass(cls):
        cls._folder = tempfile.TemporaryDirectory(prefix="ttsdf_remade_")

    @classmethod
    def tearDownClass(cls):
        cls._folder.cleanup()

    def case(self, name):
        if name not in self.made:
            makers = {"02-w2c": remake.w2c, "04-scale": remake.depth_scale, "06-intrinsics": remake.intrinsics,
                      "08-points": remake.points, "10-mesh-segv": remake.mesh_segv, "11-mesh-partial": remake.mesh_partial,
                      "15-mesh-utm": remake.mesh_utm, "16-no-end": lambda f: remake.no_end(f, VOLUMES),
                      "16-tiny-mesh": remake.tiny_mesh, "22-rowstep": remake.row_step, "25-binning-roi": remake.binning_roi,
                      "29-zero-poses": remake.zero_poses, "38-device-output": remake.device_output,
                      "41-double-ply": lambda f: remake.double_ply(f, build), "42-same-point": remake.same_point,
                      "50-hostile": lambda f: remake.hostile(f, VOLUMES)}
            folder = pathlib.Path(self._folder.name) / name
            folder.mkdir()
            makers[name](folder)
            self.made[name] = folder
        return self.made[name]


@unittest.skipUnless(GIVEN, "TTSDF_FIELD_CASES names no folder of cases")
class Given(Cases, unittest.TestCase):
    scan_within, bag_within = 0.003, 0.0043  # [m]: as right runs have it

    def case(self, name):
        folder = pathlib.Path(GIVEN) / name
        if not folder.is_dir():
            self.skipTest("%s is not there" % folder)
        return folder


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    unittest.main(argv=[sys.argv[0]] + sys.argv[3:], verbosity=1)
