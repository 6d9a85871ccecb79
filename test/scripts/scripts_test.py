#!/usr/bin/python3
"""Tests of the Python scripts: known input, known output. Run by ctest; needs rosbag but no ROS master."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import rosbag
from PIL import Image

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = REPOSITORY / "scripts"
sys.path.insert(0, str(SCRIPTS))
import poses  # noqa: E402


def run(script, *arguments):
    return subprocess.run([str(SCRIPTS / script)] + [str(a) for a in arguments], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, universal_newlines=True, timeout=60)


class ScriptTest(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="ttsdf_scripts_")
        self.folder = pathlib.Path(self._folder.name)

    def tearDown(self):
        self._folder.cleanup()


def true_pose(n):
    """A metre in 20 steps, turning."""
    return poses.pose(poses.exp_so3([0.0, 0.02 * n, 0.01 * n]), [0.05 * n, 1.0, 0.5])


class Poses(unittest.TestCase):
    def test_quaternions_turn_back_into_the_same_rotation_even_near_pi(self):
        random = np.random.RandomState(3)
        for angle in (0.0, 1e-9, 0.3, 2.0, np.pi - 1e-9, np.pi):
            for _ in range(20):
                axis = random.normal(size=3)
                R = poses.exp_so3(angle * axis / np.linalg.norm(axis))
                back = poses.rotation_from_quaternion(poses.quaternion_from_rotation(R))
                self.assertLess(np.abs(back - R).max(), 1e-12)
                self.assertAlmostEqual(poses.rotation_angle(R), angle, places=7)

    def test_orthonormalized_refuses_what_is_no_rotation(self):
        for bad in (np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0]), np.full((4, 4), np.nan), np.eye(3)):
            self.assertRaises(ValueError, poses.orthonormalized, bad)


class FramesToBag(ScriptTest):
    def setUp(self):
        super().setUp()
        self.frames = self.folder / "frames"
        self.frames.mkdir()
        np.savetxt(self.frames / "camera-intrinsics.txt", [[500, 0, 4], [0, 510, 3], [0, 0, 1]])
        for n in range(20):
            depth = np.full((6, 8), 1000 + n, dtype=np.uint16)
            depth[0, 0], depth[0, 1] = 65535, 0
            Image.fromarray(depth).save(self.frames / ("frame-%06d.depth.png" % n))
            np.savetxt(self.frames / ("frame-%06d.pose.txt" % n), true_pose(n))
        self.bag = self.folder / "out.bag"

    def messages(self, topic):
        with rosbag.Bag(str(self.bag)) as bag:
            return [message for _, message, _ in bag.read_messages(topics=[topic])]

    def convert(self, *options):
        result = run("frames_to_bag", self.frames, self.bag, *options)
        self.assertEqual(result.returncode, 0, result.stdout)
        return result.stdout

    def test_images_camera_and_stamps(self):
        self.convert("--every", 2, "--offset", 1, "--rate", 10, "--start", 50)
        images = self.messages("camera/depth/image_rect")
        self.assertEqual(len(images), 10)
        self.assertEqual(images[3].encoding, "16UC1")
        self.assertEqual(images[3].header.stamp.to_nsec(), 50300000000)
        depth = np.frombuffer(images[3].data, dtype="<u2").reshape(6, 8)
        self.assertEqual((depth[0, 0], depth[0, 1], depth[5, 7]), (0, 0, 1007))
        info = self.messages("camera/depth/camera_info")[3]
        self.assertEqual((info.header.stamp, info.header.frame_id), (images[3].header.stamp, images[3].header.frame_id))
        self.assertEqual((info.K[0], info.K[4], info.K[2], info.K[5]), (500, 510, 4, 3))
        self.assertEqual((info.width, info.height), (8, 6))

    def test_other_depth_units_become_metres(self):
        self.convert("--depth-scale", 5000)
        depth = np.frombuffer(self.messages("camera/depth/image_rect")[0].data, dtype="<f4").reshape(6, 8)
        self.assertTrue(np.isnan(depth[0, 0]) and np.isnan(depth[0, 1]))
        self.assertAlmostEqual(float(depth[5, 7]), 0.2, places=6)

    def camera_poses(self, parent_child):
        """The camera's poses in the frame of the first transform of the chain, per stamp."""
        mount = self.matrix(self.messages("/tf_static")[0].transforms[0])
        result = []
        for message in self.messages("/tf"):
            T = np.eye(4)
            named = {(t.header.frame_id, t.child_frame_id): t for t in message.transforms}
            for pair in parent_child:
                T = T @ self.matrix(named[pair])
            result.append(T @ mount)
        return result

    @staticmethod
    def matrix(stamped):
        t, q = stamped.transform.translation, stamped.transform.rotation
        return poses.pose(poses.rotation_from_quaternion([q.x, q.y, q.z, q.w]), [t.x, t.y, t.z])

    def test_odometry_without_drift_has_the_true_motion(self):
        self.convert("--drift-translation", 0, "--drift-rotation", 0)
        odometry = self.camera_poses([("odom", "base_link")])
        for n in range(20):
            expected = poses.inverse(true_pose(0)) @ true_pose(n)
            self.assertLess(np.abs(poses.inverse(odometry[0]) @ odometry[n] - expected).max(), 1e-9)

    def test_odometry_drifts_as_asked(self):
        self.convert("--drift-translation", 0.05, "--drift-rotation", 0)
        odometry = self.camera_poses([("odom", "base_link")])
        error = poses.inverse(poses.inverse(true_pose(0)) @ true_pose(19)) @ poses.inverse(odometry[0]) @ odometry[19]
        # Less than a metre: one direction in the base's frame, which turns by 0.4 rad; so nearly 5 % of 0.95 m.
        self.assertLess(np.linalg.norm(error[:3, 3]), 0.05 * 0.95 + 1e-9)
        self.assertGreater(np.linalg.norm(error[:3, 3]), 0.05 * 0.95 * np.cos(0.4))
        self.assertLess(poses.rotation_angle(error[:3, :3]), 1e-6)

    def test_truth_tf_gives_the_true_camera_pose_with_and_without_odometry(self):
        for options, chain in ((["--truth-tf"], [("map", "odom"), ("odom", "base_link")]),
                               (["--truth-tf", "--no-odometry"], [("map", "base_link")])):
            self.convert(*options)
            for n, T in enumerate(self.camera_poses(chain)):
                self.assertLess(np.abs(T - true_pose(n)).max(), 1e-9)

    def test_no_odometry_leaves_no_tf(self):
        self.convert("--no-odometry", "--no-initialpose")
        self.assertEqual(self.messages("/tf"), [])
        self.assertEqual(self.messages("initialpose"), [])
        self.assertEqual(len(self.messages("ground_truth")), 20)

    def test_bad_frames_are_named_and_left_out(self):
        (self.frames / "frame-000003.depth.png").write_bytes(b"not a picture")
        np.savetxt(self.frames / "frame-000005.pose.txt", np.full((4, 4), np.nan))
        output = self.convert()
        self.assertIn("frame-000003.depth.png", output)
        self.assertIn("frame-000005.pose.txt", output)
        self.assertEqual(len(self.messages("camera/depth/image_rect")), 18)

    def test_a_folder_without_poses_is_an_error_and_leaves_no_bag(self):
        for file in self.frames.glob("*.pose.txt"):
            file.unlink()
        result = run("frames_to_bag", self.frames, self.bag)
        self.assertEqual(result.returncode, 1)
        self.assertIn("pose", result.stdout)
        self.assertEqual(list(self.folder.glob("out.bag*")), [])


class EvaluateTrajectory(ScriptTest):
    def write(self, name, transforms, stamps):
        path = self.folder / name
        rows = [[t] + list(T[:3, 3]) + list(poses.quaternion_from_rotation(T[:3, :3])) for t, T in zip(stamps, transforms)]
        np.savetxt(path, rows, fmt="%.9f")
        return path

    def evaluate(self, estimate, stamps, *options):
        truth = self.write("truth.txt", [true_pose(n) for n in range(20)], range(20))
        figures = self.folder / "figures.json"
        result = run("evaluate_trajectory", truth, self.write("estimate.txt", estimate, stamps), "--json", figures, *options)
        self.assertEqual(result.returncode, 0, result.stdout)
        return json.loads(figures.read_text())

    def test_a_known_offset_is_the_error(self):
        offset = poses.pose(poses.exp_so3([0.0, 0.0, 0.1]), [0.03, 0.0, 0.04])
        figures = self.evaluate([true_pose(n) @ offset for n in range(20)], range(20))
        self.assertEqual(figures["matched"], 20)
        self.assertAlmostEqual(figures["ate_translation"]["rmse"], 0.05, places=6)
        self.assertAlmostEqual(figures["ate_rotation"]["max"], 0.1, places=6)

    def test_alignment_takes_a_common_motion_away(self):
        motion = poses.pose(poses.exp_so3([0.2, 0.0, 0.3]), [1.0, 2.0, 3.0])
        figures = self.evaluate([motion @ true_pose(n) for n in range(20)], range(20), "--align")
        self.assertLess(figures["ate_translation"]["max"], 1e-6)

    def test_only_poses_with_near_stamps_are_matched(self):
        stamps = [n + (0.0005 if n % 2 else 0.4) for n in range(20)]
        figures = self.evaluate([true_pose(n) for n in range(20)], stamps)
        self.assertEqual(figures["matched"], 10)
        self.assertLess(figures["ate_translation"]["max"], 1e-6)

    def test_a_bar_that_is_missed_is_a_failure(self):
        truth = self.write("truth.txt", [true_pose(n) for n in range(20)], range(20))
        moved = self.write("moved.txt", [poses.pose(None, [0.1, 0, 0]) @ true_pose(n) for n in range(20)], range(20))
        self.assertEqual(run("evaluate_trajectory", truth, moved, "--max-ate", 0.2).returncode, 0)
        self.assertEqual(run("evaluate_trajectory", truth, moved, "--max-ate", 0.05).returncode, 1)

    def test_unusable_input_is_named(self):
        result = run("evaluate_trajectory", "/nowhere/a.txt", "/nowhere/b.bag:pose")
        self.assertEqual(result.returncode, 1)
        self.assertIn("/nowhere/a.txt", result.stdout)
        result = run("evaluate_trajectory", "/nowhere/a.bag", "/nowhere/b.bag:pose")
        self.assertIn("got a bag without a topic, wanted /nowhere/a.bag:TOPIC", result.stdout)


class SummarizeTests(ScriptTest):
    def summary(self, entries, files):
        results = self.folder / "results"
        (results / "package").mkdir(parents=True)
        text = "".join("%3d/%d Test #%d: %s %s   %s    0.01 sec\n" % (n, len(entries), n, name, "." * 20, outcome)
                       for n, (name, outcome) in enumerate(entries, 1))
        (results / "ctest_unit.txt").write_text("Test project /build\n" + text)
        for name, body in files.items():
            (results / "package" / name).write_text("<testsuite>" + body + "</testsuite>")
        result = run("summarize_tests", results)
        return result.returncode, result.stdout.strip().splitlines()

    def test_counts_cases_and_names_what_was_skipped_or_failed(self):
        code, lines = self.summary(
            [("_ctest_package_gtest_a_test", "***Failed"), ("plain", "Passed")],
            {"gtest-a_test.xml": '<testcase classname="A" name="One"/><testcase classname="A" name="Two"><failure/>'
                                 '</testcase><testcase classname="A" name="Three"><skipped message="no data"/></testcase>'})
        self.assertEqual(code, 1)
        self.assertEqual(lines[-1], "2 passed, 1 failed, 1 skipped")
        self.assertIn("FAILED   a_test: A.Two", lines)
        self.assertTrue(any("A.Three (no data)" in line for line in lines))

    def test_a_crash_and_missing_results_are_failures(self):
        code, lines = self.summary(
            [("_ctest_package_gtest_a_test", "***Failed"), ("_ctest_package_gtest_b_test", "Passed")],
            {"gtest-a_test.xml": '<testcase classname="A" name="One"/>'})
        self.assertEqual((code, lines[-1]), (1, "1 passed, 2 failed, 0 skipped"))

    def test_programs_without_results_count_by_what_ctest_says(self):
        code, lines = self.summary([("a", "Passed"), ("b", "***Timeout"), ("c", "***Skipped"), ("d", "***Not Run"),
                                    ("e", "***Exception: SegFault"), ("f", "Subprocess aborted***Exception:")], {})
        self.assertEqual((code, lines[-1]), (1, "1 passed, 4 failed, 1 skipped"))

    def test_rostest_cases_count_once(self):
        code, lines = self.summary(
            [("_ctest_package_rostest_test_ros_x.test", "Passed")],
            {"rostest-test_ros_x.xml": '<testcase classname="R" name="testx_node"/>',
             "rosunit-x_node.xml": '<testcase classname="X" name="One"/><testcase classname="X" name="Two"/>'})
        self.assertEqual((code, lines[-1]), (0, "2 passed, 0 failed, 0 skipped"))

    def test_nothing_run_is_no_success(self):
        self.assertEqual(self.summary([], {}), (1, ["0 passed, 0 failed, 0 skipped"]))


class Fresh(unittest.TestCase):
    """What scripts/fresh refuses; whether it makes a root is seen where CI uses it."""

    @classmethod
    def setUpClass(cls):
        # A copy that everybody can read, wherever the checkout is.
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.folder.chmod(0o755)
        for name in ("fresh", "fresh_root.sh", "lib.sh"):
            shutil.copy(SCRIPTS / name, cls.folder / name)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def refused(self, *arguments, **options):
        return subprocess.run([str(self.folder / "fresh")] + list(arguments), stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, universal_newlines=True, timeout=60, **options)

    def test_wrong_usage(self):
        for arguments, said in (([], "got no command"), (["--release", "potato", "true"], "wanted bookworm, bullseye or trixie"),
                                (["--arch", "vax", "true"], "--arch: got 'vax'"), (["--release"], "got nothing")):
            result = self.refused(*arguments)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(said, result.stdout)

    def test_a_user_without_rights_is_told_so_in_one_line(self):
        def become_nobody():
            if os.getuid() == 0:
                os.setgid(65534)
                os.setuid(65534)
        result = self.refused("true", preexec_fn=become_nobody, cwd="/", env={"PATH": "/usr/bin:/bin", "HOME": "/nonexistent"})
        self.assertEqual(result.returncode, 125, result.stdout)
        self.assertEqual(len(result.stdout.strip().splitlines()), 1, result.stdout)
        self.assertIn("no root: got user", result.stdout)


class Scripts(unittest.TestCase):
    def test_every_script_has_help(self):
        scripts = [path.name for path in SCRIPTS.iterdir() if os.access(path, os.X_OK) and path.is_file()]
        self.assertIn("demo", scripts)
        for name in scripts:
            result = run(name, "--help")
            self.assertEqual(result.returncode, 0, name)
            self.assertIn("usage", result.stdout.lower(), name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
