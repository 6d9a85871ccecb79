#!/usr/bin/python3
"""The whole chain through the launch files: synthetic depth frames -> bags -> map built live -> camera localized in it.

The scene is rendered here, independently of the project's simulation. Each test runs roslaunch as a user would.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rospy
import rostest

FOLDER = os.path.dirname(os.path.abspath(__file__))
SCRIPTS = os.path.join(FOLDER, "..", "..", "scripts")
sys.path.insert(0, FOLDER)
import synthetic_frames  # noqa: E402

from ttsdf_localization.msg import BuildProgress, LocalizationStatus  # noqa: E402
from ttsdf_localization.srv import BuildMap  # noqa: E402

FRAMES = 150
EVERY = 5  # of which the map is made


def run(script, *arguments):
    subprocess.run([os.path.join(SCRIPTS, script)] + [str(a) for a in arguments], check=True, timeout=120)


class Launch:
    """roslaunch under this test's master; stopped when the block is left."""

    def __init__(self, file, **arguments):
        self.command = ["roslaunch", "ttsdf_localization", file]
        self.command += ["%s:=%s" % item for item in arguments.items()]

    def __enter__(self):
        self.process = subprocess.Popen(self.command)
        return self.process

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60)


class BagReplay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("bag_replay_test", disable_rostime=True)
        cls.folder = tempfile.mkdtemp(prefix="ttsdf_bag_replay_")
        cls.frames = cls.path("frames")
        os.mkdir(cls.frames)
        synthetic_frames.write_folder(cls.frames, FRAMES)
        run("frames_to_bag", cls.frames, cls.path("mapping.bag"), "--every", EVERY, "--rate", 10, "--truth-tf")
        cls.map_file = cls.path("room.ttsdf")
        cls.report = cls.build_map()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @classmethod
    def build_map(cls):
        fused = []
        rospy.Subscriber("map_builder/progress", BuildProgress, lambda message: fused.append(message.fused))
        with Launch("build_map.launch", bag=cls.path("mapping.bag")):
            build = rospy.ServiceProxy("map_builder/build_map", BuildMap)
            build.wait_for_service(timeout=30)
            deadline = time.monotonic() + 60
            while not (fused and fused[-1] == FRAMES // EVERY) and time.monotonic() < deadline:
                time.sleep(0.1)
            reply = build(filename=cls.map_file)
        if not reply.success:
            raise RuntimeError("no map: " + reply.message)
        return reply.report

    def replay(self, name, odometry):
        """Plays a bag of all frames at 15 Hz; returns what evaluate_trajectory says."""
        bag, output, figures = self.path(name + ".bag"), self.path(name + "_out.bag"), self.path(name + ".json")
        options = [] if odometry else ["--no-odometry"]
        run("frames_to_bag", self.frames, bag, "--rate", 15, *options)
        with Launch("replay.launch", bag=bag, map=self.map_file, record=output,
                    odom_frame_id="odom" if odometry else "none") as process:
            process.wait(timeout=90)
        run("evaluate_trajectory", output + ":ground_truth", output + ":pose", "--status", output + ":status",
            "--json", figures)
        with open(figures) as file:
            return json.load(file)

    def check(self, figures, share):
        self.assertLess(figures["ate_translation"]["rmse"], 0.025)
        self.assertGreater(figures["matched"], share * FRAMES)

    def test_map_has_every_scan(self):
        self.assertEqual(self.report.scans, FRAMES // EVERY)
        self.assertTrue(os.path.getsize(self.map_file) == self.report.file_bytes)

    def test_tracks_with_drifting_odometry(self):
        figures = self.replay("odometry", True)
        self.check(figures, 0.9)
        self.assertNotIn("lost", figures["status"]["states"])

    def test_tracks_without_odometry(self):
        # One wall without anything on it fills the image for seconds: no pose is better than a guess that is called good.
        self.check(self.replay("handheld", False), 0.6)

    def test_goes_on_when_the_bag_loops(self):
        bag = self.path("loop.bag")
        run("frames_to_bag", self.frames, bag, "--rate", 15, "--every", 3)  # 3 s
        states, loops = [], [0]
        changed = threading.Condition()

        def on_status(status):
            with changed:
                states.append(status)
                if status.reason == LocalizationStatus.REASON_TIME_JUMP:
                    loops[0] += 1
                    del states[:-1]
                changed.notify_all()
        subscriber = rospy.Subscriber("status", LocalizationStatus, on_status, queue_size=200)
        with Launch("replay.launch", bag=bag, map=self.map_file, loop=True), changed:
            for loop in (1, 2):
                self.assertTrue(changed.wait_for(
                    lambda loop=loop: loops[0] >= loop and any(s.pose_valid for s in states), 90), states[-3:])
        subscriber.unregister()
        # On the same map, and nobody had to say where the camera is.
        self.assertEqual(len({s.map_id for s in states}), 1)


if __name__ == "__main__":
    rostest.rosrun("ttsdf_localization", "bag_replay", BagReplay)
