#!/usr/bin/env python3
"""Traps that other localizers fall into (doc/behaviour_tests.md), on frames with other names than usual."""

import unittest

import numpy as np
import rospy
import rostest

import room
from fake_robot import START, FakeRobot, Recorder, Status, cloud_message, errors, matrix, start_tracking

FAR = room.pose(5.3, 2.9, 0.0, 3.0)  # farther from the map's origin than max_range


class Traps(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recorder = Recorder(parent='world', child='wheels')
        cls.robot = FakeRobot(odom='wheels').start()

    @classmethod
    def tearDownClass(cls):
        cls.robot.stop()

    def setUp(self):
        self.restart_at(START)

    def restart_at(self, pose):
        self.robot.change_points = None
        self.robot.send_clouds = True
        self.robot.velocity = 0.0
        self.robot.kidnap(pose)
        start_tracking(self, self.recorder, self.robot)
        self.assertTrue(self.recorder.wait_for_new(self.recorder.poses, 2), self.recorder.history())

    def error_of(self, pose):
        truth = self.robot.truth[pose.header.stamp.to_nsec()]
        return errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)

    def test_leaving_the_map_is_no_perfect_fit(self):
        r = self.recorder
        points = self.robot.points()
        self.robot.change_points = lambda _, n: points
        # The wheels say that it went 50 m away; the points there meet nothing but the space outside the map.
        begin = len(r.poses)
        status = r.wait_for_status(lambda s: s.reason == Status.REASON_OUTSIDE_MAP, do=lambda: setattr(
            self.robot, 'T_map_base', room.pose(50.0, 0.0, 0.0, 0.0) @ START))
        self.assertIsNotNone(status, r.history())
        self.assertFalse(status.pose_valid)
        self.assertEqual(status.outside_ratio, 1.0)
        poses = len(r.poses)
        self.assertLessEqual(poses - begin, 1)  # one from before may have been on its way
        self.assertIsNotNone(r.wait_for_status(lambda s: s.state in (Status.LOST, Status.WAITING_FOR_POSE)), r.history())
        self.assertEqual(len(r.poses), poses)

    def test_roll_and_pitch_are_estimated(self):
        """A ramp that the wheels do not notice."""
        r = self.recorder
        self.robot.kidnap(START @ room.pose(0.0, 0.0, 0.0, 0.0, 0.06, -0.05))
        self.assertTrue(r.wait_for_new(r.poses, 5), r.history())
        translation, rotation = self.error_of(r.poses[-1])
        self.assertLess(translation, 0.02)
        self.assertLess(rotation, 0.01)

    def test_the_range_is_measured_from_the_sensor(self):
        r = self.recorder
        self.assertGreater(np.linalg.norm(FAR[:3, 3]), 4.0)  # max_range of this test
        self.restart_at(FAR)
        self.assertLess(self.error_of(r.poses[-1])[0], 0.02)

    def test_one_wall_leaves_three_directions_to_the_prior(self):
        r = self.recorder
        self.restart_at(room.pose(2.6, 2.5, 0.0, 0.0))

        def only_the_wall(points, _):
            in_map = points @ (self.robot.T_map_base @ room.T_BASE_CAMERA)[:3, :3].T
            x = in_map[:, :, 0] + (self.robot.T_map_base @ room.T_BASE_CAMERA)[0, 3]
            points[np.abs(x - room.SIZE[0]) > 0.02] = np.nan
            return points
        self.robot.change_points = only_the_wall
        self.robot.velocity = 0.2
        status = r.wait_for_status(lambda s: s.degenerate_directions > 0)
        self.assertIsNotNone(status, r.history())
        # Along the wall twice and about its normal; where the wall ends, its edges say a little.
        self.assertGreaterEqual(status.degenerate_directions, 2)
        self.assertIn('little information', status.message)
        self.assertTrue(r.wait_for_new(r.poses, 20), r.history())
        pose = r.poses[-1]
        self.assertLess(self.error_of(pose)[0], 0.05)  # the prior counts, nothing slides along the wall
        sigma = np.sqrt(np.diag(np.array(pose.pose.covariance).reshape(6, 6)))
        self.assertGreater(sigma[1], 5.0 * sigma[0])  # along the wall against across it
        self.assertGreater(sigma[2], sigma[0])  # up and down the edges of the wall say something

    def test_a_burst_of_clouds_ends_with_the_newest(self):
        """Forty clouds of a whole VGA image at once: the work stays bounded, and the newest is not left behind."""
        r = self.recorder
        self.robot.send_clouds = False
        large = np.kron(self.robot.points(), np.ones((10, 10, 1), np.float32))
        begin = len(r.poses)
        for _ in range(40):
            stamp = rospy.Time.now()
            self.robot.truth[stamp.to_nsec()] = self.robot.T_map_base.copy()
            self.robot.publish_cloud(cloud_message(large, 'camera', stamp))
        self.assertTrue(r.wait_for(lambda: r.poses[-1].header.stamp >= stamp), r.history())
        self.assertLessEqual(len(r.poses) - begin, 42)
        self.assertLessEqual(r.statuses[-1].points, 5000)


if __name__ == '__main__':
    rospy.init_node('traps_test')
    rostest.rosrun('ttsdf_localization', 'traps', Traps)
