#!/usr/bin/env python3
"""Without odometry: constant velocity, and map -> base is published with the scan's own stamp."""

import unittest

import rospy
import rostest

from fake_robot import FakeRobot, Recorder, errors, matrix, start_tracking


class NoOdometry(unittest.TestCase):
    def test_the_base_is_tracked_and_published(self):
        r = Recorder(child='base_link')
        others = Recorder(child='odom')
        robot = FakeRobot(odom='').start()
        start_tracking(self, r, robot)
        robot.velocity = 0.3
        self.assertTrue(r.wait_for_new(r.poses, 25), r.history())
        for pose in r.poses[-20:]:
            truth = robot.truth[pose.header.stamp.to_nsec()]
            self.assertLess(errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)[0], 0.02)
        exact = [t for t in r.transforms if t.header.stamp.to_nsec() in robot.truth]
        self.assertGreater(len(exact), 3)
        for t in exact[3:]:
            T = matrix(t.transform.translation, t.transform.rotation)
            self.assertLess(errors(T, robot.truth[t.header.stamp.to_nsec()])[0], 0.03)
        stamps = [t.header.stamp for t in r.transforms]
        for earlier, later in zip(stamps, stamps[1:]):
            self.assertLess(earlier, later)
        self.assertEqual(others.transforms, [])  # the tree never flips
        robot.stop()


if __name__ == '__main__':
    rospy.init_node('no_odometry_test')
    rostest.rosrun('ttsdf_localization', 'no_odometry', NoOdometry)
