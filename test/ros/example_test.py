#!/usr/bin/env python3
"""The example launch files, fed with the depth images of a camera that moves: poses agree with the truth."""

import unittest

import numpy as np
import rospy
import rostest

import room
from fake_robot import FakeRobot, Recorder, errors, matrix, start_tracking

OPTICAL = np.eye(4)
OPTICAL[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


class Example(unittest.TestCase):
    def check(self, recorder, robot, T_base_child):
        robot.velocity = 0.2
        self.assertTrue(recorder.wait_for_new(recorder.poses, 30), recorder.history())
        for pose in recorder.poses[-20:]:
            truth = robot.truth[pose.header.stamp.to_nsec()] @ T_base_child
            self.assertLess(errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)[0], 0.03)
        robot.stop()

    def test_it_localizes(self):
        if rospy.get_param('~handheld', False):
            robot = FakeRobot(odom=None, mount=False, depth_image='camera/depth/image_rect',
                              camera_info='camera/depth/camera_info', camera='camera_depth_optical_frame').start()
            # Nobody gives a start pose: it is found. The child is the camera's link, x forward.
            self.check(Recorder(child='camera_link'), robot, room.T_BASE_CAMERA @ np.linalg.inv(OPTICAL))
            return
        recorder = Recorder()
        robot = FakeRobot(mount=False, depth_image='camera/depth/image_rect_raw',
                          camera_info='camera/depth/camera_info', camera='camera_depth_optical_frame').start()
        start_tracking(self, recorder, robot)
        self.check(recorder, robot, np.eye(4))


if __name__ == '__main__':
    rospy.init_node('example_test')
    rostest.rosrun('ttsdf_localization', 'example', Example)
