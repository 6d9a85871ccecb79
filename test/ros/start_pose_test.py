#!/usr/bin/env python3
"""The start pose comes from parameters, or from the file in which the last good pose was kept."""

import os
import signal
import subprocess
import tempfile
import unittest

import roslib.packages
import rospy
import rostest

from fake_robot import START, FakeRobot, Recorder, errors, matrix


class StartPose(unittest.TestCase):
    def setUp(self):
        self.recorder = Recorder()
        self.robot = FakeRobot().start()
        rospy.set_param('localization', {'map_file': os.path.join(rospy.get_param('~map_dir'), 'room.ttsdf')})

    def tearDown(self):
        self.robot.stop()
        rospy.delete_param('localization')

    def run_node(self, until):
        """Starts the localizer, and ends it as roslaunch would when `until` is true."""
        if rospy.get_param('~nodelet'):
            command = [roslib.packages.find_node('nodelet', 'nodelet')[0], 'standalone',
                       'ttsdf_localization/LocalizationNodelet']
        else:
            command = [roslib.packages.find_node('ttsdf_localization', 'localization_node')[0]]
        process = subprocess.Popen(command + ['__name:=localization'])
        try:
            self.assertTrue(self.recorder.wait_for(until, 90.0), self.recorder.history())
        finally:
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(timeout=60.0), 0)

    def assert_right(self, pose):
        truth = self.robot.truth[pose.header.stamp.to_nsec()]
        self.assertLess(errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)[0], 0.02)

    def test_from_parameters_then_from_the_file(self):
        poses = self.recorder.poses
        with tempfile.TemporaryDirectory() as folder:
            rospy.set_param('localization/pose_file', os.path.join(folder, 'pose.yaml'))
            rospy.set_param('localization/set_initial_pose', True)
            rospy.set_param('localization/initial_pose_x', float(START[0, 3]) + 0.1)
            rospy.set_param('localization/initial_pose_y', float(START[1, 3]))
            rospy.set_param('localization/initial_pose_yaw', 0.5)
            self.robot.velocity = 0.3
            self.run_node(lambda: len(poses) > 10)
            self.assert_right(poses[-1])
            self.robot.velocity = 0.0

            # Ended: what was known is in the file, and wins over the parameters, which now say something wrong.
            self.assertTrue(os.path.exists(os.path.join(folder, 'pose.yaml')))
            rospy.set_param('localization/initial_pose_x', 5.0)
            rospy.set_param('localization/recovery', {'allow_global': False})
            begin = len(poses)
            self.run_node(lambda: len(poses) > begin + 5)
            self.assert_right(poses[-1])


if __name__ == '__main__':
    rospy.init_node('start_pose_test')
    rostest.rosrun('ttsdf_localization', 'start_pose', StartPose)
