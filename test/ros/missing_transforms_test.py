#!/usr/bin/env python3
"""Without transforms there is no pose, never a guessed one; a drop-out of odometry is bridged."""

import unittest

import rospy
import rostest

from fake_robot import FakeRobot, Recorder, Status, errors, matrix, pose_message


class MissingTransforms(unittest.TestCase):
    """One story in order: no odometry at all, odometry comes, drops out, comes back."""

    def test_scans_wait_for_transforms_and_a_drop_out_is_bridged(self):
        r = Recorder()
        robot = FakeRobot()
        robot.send_odometry = False
        robot.start()
        self.assertTrue(robot.wait_for_subscriber())
        self.assertTrue(r.wait_for(lambda: any(s.map_id for s in r.statuses)), 'no map')

        # The start pose comes before the odometry does, and must not get lost.
        r.wait_for_initialpose_connection()
        r.set_pose(pose_message(robot.T_map_base, stamp=rospy.Time.now()))
        status = r.wait_for_status(lambda s: s.reason == Status.REASON_NO_TRANSFORM)
        self.assertIsNotNone(status, r.history())
        self.assertIn('odom', status.message)
        self.assertIn('camera', status.message)
        self.assertEqual(r.poses, [])
        self.assertEqual(r.transforms, [])

        robot.send_odometry = True
        self.assertTrue(r.wait_for_state(Status.TRACKING), r.history())
        self.assertTrue(r.wait_for_new(r.poses, 5))

        robot.velocity = 0.2
        robot.send_odometry = False
        begin = len(r.poses)
        status = r.wait_for_status(lambda s: s.pose_valid and 'odometry is missing' in s.message)
        self.assertIsNotNone(status, r.history())
        first = status.header.stamp
        self.assertTrue(r.wait_for(lambda: (r.poses[-1].header.stamp - first).to_sec() > 2.0), r.history())
        for pose in r.poses[begin:]:
            translation, _ = errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation),
                                    robot.truth[pose.header.stamp.to_nsec()])
            self.assertLess(translation, 0.02)

        robot.send_odometry = True
        self.assertIsNotNone(r.wait_for_status(lambda s: s.pose_valid and 'odometry' not in s.message), r.history())
        self.assertFalse(any(s.state == Status.LOST for s in r.statuses), r.history())
        robot.stop()


if __name__ == '__main__':
    rospy.init_node('missing_transforms_test')
    rostest.rosrun('ttsdf_localization', 'missing_transforms', MissingTransforms)
