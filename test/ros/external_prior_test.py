#!/usr/bin/env python3
"""The prior comes from a transform that somebody else publishes; nothing is broadcast."""

import unittest

import rospy
import rostest
from tf2_msgs.msg import TFMessage

import room
from fake_robot import FakeRobot, Recorder, errors, matrix, transform


class ExternalPrior(unittest.TestCase):
    def test_an_external_transform_is_the_prior(self):
        r = Recorder()
        robot = FakeRobot()
        tf = rospy.Publisher('/tf', TFMessage, queue_size=50)
        step = robot.step

        def with_prior(stamp=None):
            stamp = stamp or rospy.Time.now()
            rough = robot.T_map_odom @ room.pose(0.08, -0.05, 0.03, 0.02)
            tf.publish([transform('map', 'odom', rough, stamp)])
            step(stamp)
        robot.step = with_prior
        robot.start()
        self.assertTrue(r.wait_for_new(r.poses, 5), r.history())
        pose = r.poses[-1]
        truth = robot.truth[pose.header.stamp.to_nsec()]
        self.assertLess(errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)[0], 0.02)
        callers = {t.header.stamp.to_nsec() for t in r.transforms}
        self.assertLessEqual(len(callers), len(robot.truth) + 1)  # only ours
        robot.stop()


if __name__ == '__main__':
    rospy.init_node('external_prior_test')
    rostest.rosrun('ttsdf_localization', 'external_prior', ExternalPrior)
