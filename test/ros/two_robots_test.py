#!/usr/bin/env python3
"""Two localizers in one nodelet manager do not know of each other; one can be unloaded under load."""

import subprocess
import unittest

import roslib.packages
import rospy
import rostest

import room
from fake_robot import FakeRobot, Recorder, errors, matrix, start_tracking

POSES = {'one': room.pose(1.6, 1.2, 0.0, 0.5), 'two': room.pose(3.2, 3.6, 0.0, -1.2)}
MAPS = {'one': 'map', 'two': 'two/world'}


class TwoRobots(unittest.TestCase):
    def test_each_has_its_own_pose(self):
        recorders, robots = {}, {}
        for name, pose in POSES.items():
            recorders[name] = Recorder(namespace=name, child=name + '/odom', parent=MAPS[name])
            robots[name] = FakeRobot(prefix=name + '/', odom=name + '/odom', cloud=name + '/cloud', start=pose).start()
        for name in POSES:
            start_tracking(self, recorders[name], robots[name])
        for name in POSES:
            r = recorders[name]
            self.assertTrue(r.wait_for_new(r.poses, 3), r.history())
            self.assertTrue(r.wait_for_new(r.transforms, 3))
            pose = r.poses[-1].pose.pose
            self.assertLess(errors(matrix(pose.position, pose.orientation), POSES[name])[0], 0.02)

        # Unloaded in the middle of its work: manager and neighbour live on.
        nodelet = roslib.packages.find_node('nodelet', 'nodelet')[0]
        done = subprocess.run([nodelet, 'unload', '/one/localization', '/manager'], timeout=60.0, check=False)
        self.assertEqual(done.returncode, 0)
        one, two = recorders['one'], recorders['two']
        self.assertTrue(two.wait_for_new(two.poses, 5), two.history())
        count = len(one.poses)
        self.assertTrue(two.wait_for_new(two.poses, 5), two.history())
        self.assertEqual(len(one.poses), count)
        for robot in robots.values():
            robot.stop()


if __name__ == '__main__':
    rospy.init_node('two_robots_test')
    rostest.rosrun('ttsdf_localization', 'two_robots', TwoRobots)
