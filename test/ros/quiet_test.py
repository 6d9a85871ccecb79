#!/usr/bin/env python3
"""Quiet is suspicious: without clouds or transforms there is a warning that names the topic or the frames."""

import threading
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Log

from fake_robot import FakeRobot


class Quiet(unittest.TestCase):
    def setUp(self):
        self.messages = []
        self.changed = threading.Condition()
        self.subscriber = rospy.Subscriber('/rosout', Log, self.on_log, queue_size=100)

    def on_log(self, message):
        with self.changed:
            if message.level >= Log.WARN:
                self.messages.append(message.msg)
            self.changed.notify_all()

    def warned(self, *words):
        def check():
            return any(all(word in text for word in words) for text in self.messages)
        with self.changed:
            return self.changed.wait_for(check, 60.0)

    def test_no_cloud_then_no_transform(self):
        self.assertTrue(self.warned('no cloud', '/camera/points', 'depth_image:=true'), self.messages)
        robot = FakeRobot(cloud='camera/points')
        robot.send_odometry = False
        robot.start()
        self.assertTrue(self.warned('transforms', "'camera'", "'odom'"), self.messages)
        robot.stop()


if __name__ == '__main__':
    rospy.init_node('quiet_test')
    rostest.rosrun('ttsdf_localization', 'quiet', Quiet)
