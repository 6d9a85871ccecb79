#!/usr/bin/python3
"""Launch files without a master: which parameters they set, and what they say about misspelt arguments."""

import os
import pathlib
import subprocess
import tempfile
import unittest

import yaml

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
FRAMES = {"global_frame_id": "world", "odom_frame_id": "wheels", "base_frame_id": "body"}


def launch(file, *arguments):
    environment = dict(os.environ, ROS_MASTER_URI="http://localhost:1",
                       ROS_PACKAGE_PATH="%s:/usr/share:%s" % (REPOSITORY, os.environ.get("ROS_PACKAGE_PATH", "")))
    return subprocess.run(["roslaunch", "--dump-params", str(REPOSITORY / "launch" / file)] + list(arguments),
                          env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
                          timeout=60)


class LaunchFiles(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="ttsdf_launch_")
        self.addCleanup(self.folder.cleanup)

    def config(self, **values):
        path = os.path.join(self.folder.name, "own.yaml")
        with open(path, "w") as file:
            yaml.safe_dump(values, file)
        return "config:=" + path

    def parameters(self, file, *arguments):
        done = launch(file, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return yaml.safe_load(done.stdout)

    def expect(self, parameters, node, **values):
        self.assertEqual({key: parameters.get("/%s/%s" % (node, key)) for key in values}, values)

    def test_what_is_not_given_is_as_the_own_config_has_it(self):
        own = self.config(map_file="/own.ttsdf", **FRAMES)
        for nodelet in "true", "false":
            parameters = self.parameters("localization.launch", own, "nodelet:=" + nodelet)
            self.expect(parameters, "localization", map_file="/own.ttsdf", **FRAMES)
        self.expect(self.parameters("replay.launch", own, "bag:=/a.bag", "map:=/given.ttsdf"), "localization",
                    map_file="/given.ttsdf", **FRAMES)
        built = self.parameters("build_map.launch", self.config(global_frame_id="world", selection={"every": 7}))
        self.assertEqual((built["/map_builder/global_frame_id"], built["/map_builder/selection/every"]), ("world", 7))

    def test_what_is_given_wins(self):
        own = self.config(map_file="/own.ttsdf", **FRAMES)
        given = dict(map_file="/given.ttsdf", global_frame_id="site", odom_frame_id="none", base_frame_id="cart")
        for nodelet in "true", "false":
            parameters = self.parameters("localization.launch", own, "nodelet:=" + nodelet,
                                         *("%s:=%s" % item for item in given.items()))
            self.expect(parameters, "localization", **given)
        built = self.parameters("build_map.launch", self.config(selection={"every": 7}), "every:=3")
        self.assertEqual(built["/map_builder/selection/every"], 3)

    def test_defaults_are_those_of_the_package(self):
        self.expect(self.parameters("localization.launch"), "localization", map_file="", global_frame_id="map",
                    odom_frame_id="odom", base_frame_id="base_link")
        self.expect(self.parameters("handheld_example.launch"), "localization", odom_frame_id="none",
                    base_frame_id="camera_link")

    def test_a_camera_by_name_takes_an_own_config(self):
        own = self.config(recovery={"coast_seconds": 7.5})
        for file, arguments in (("depth_camera.launch", ["camera:=kinect"]), ("robot_example.launch", [])):
            parameters = self.parameters(file, own, *arguments)
            self.assertEqual(parameters["/localization/recovery/coast_seconds"], 7.5)
            self.assertIn("/localization/cloud/max_range", parameters)  # of the preset
        own = self.config(gates={"min_inlier_ratio": 0.11}, cloud={"max_range": 2.5})  # the camera sets max_range, too
        parameters = self.parameters("depth_camera.launch", own, "camera:=realsense_d435")
        self.assertEqual(parameters["/localization/gates/min_inlier_ratio"], 0.11)
        self.assertEqual(parameters["/localization/cloud/max_range"], 2.5)
        self.assertEqual(parameters["/localization/cloud/min_range"], 0.28)
        built = self.parameters("depth_camera.launch", "camera:=kinect", "mode:=build_map", self.config(selection={"every": 9}))
        self.assertEqual(built["/map_builder/selection/every"], 9)

    def nodes(self, file, *arguments):
        done = subprocess.run(["roslaunch", "--nodes", str(REPOSITORY / "launch" / file)] + list(arguments),
                              env=dict(os.environ, ROS_MASTER_URI="http://localhost:1",
                                       ROS_PACKAGE_PATH="%s:/usr/share" % REPOSITORY),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout.split()

    def test_the_mount_is_published_once(self):
        self.assertIn("/camera_mount", self.nodes("robot_example.launch"))
        for argument in "urdf:=%s/config/example_robot.urdf" % REPOSITORY, "described:=true":
            nodes = self.nodes("robot_example.launch", argument)
            self.assertNotIn("/camera_mount", nodes)
            self.assertNotIn("/camera_optical", nodes)

    def test_nobody_elses_parameters_are_cleared_and_no_name_is_absolute(self):
        for path in (REPOSITORY / "launch").iterdir():
            self.assertNotIn("clear_params", path.read_text(), path)
        for path in (REPOSITORY / "rviz").iterdir():
            self.assertNotRegex(path.read_text(), r"Topic: /", path)

    def test_a_misspelt_mode_or_camera_is_named(self):
        done = launch("depth_camera.launch", "camera:=kinect", "mode:=lokalization")
        self.assertEqual(done.stdout.strip(), "")  # --dump-params ends with 0 even so
        self.assertIn("mode: got lokalization, wanted localization or build_map", done.stderr)
        done = launch("depth_camera.launch", "camera:=kinnect")
        self.assertEqual(done.stdout.strip(), "")
        self.assertIn("camera: got kinnect, wanted ", done.stderr)
        for camera in (REPOSITORY / "config" / "cameras").iterdir():
            self.assertIn(camera.name, done.stderr)
            self.parameters("depth_camera.launch", "camera:=" + camera.name)
            self.parameters("depth_camera.launch", "camera:=" + camera.name, "mode:=build_map")


if __name__ == "__main__":
    unittest.main()
