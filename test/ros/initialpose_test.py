#!/usr/bin/env python3
"""initialpose in every shape that people and programs send it."""


import numpy as np
import rospy
import rostest
from std_srvs.srv import Trigger

import room
from fake_robot import RobotTestCase, Status, errors, matrix, pose_message


class InitialPose(RobotTestCase):
    def setUp(self):
        self.robot.velocity = 0.0
        r = self.recorder
        self.assertTrue(self.robot.wait_for_subscriber())
        self.assertTrue(r.wait_for(lambda: any(s.map_id for s in r.statuses)), 'no map')
        r.wait_for_initialpose_connection()
        rospy.wait_for_service('localization/reset', 30.0)
        rospy.ServiceProxy('localization/reset', Trigger)()
        self.assertTrue(r.wait_for_state(Status.WAITING_FOR_POSE), r.history())

    def assert_tracks(self):
        r = self.recorder
        self.assertTrue(r.wait_for_state(Status.TRACKING), r.history())
        self.assertTrue(r.wait_for_new(r.poses, 2))
        pose = r.poses[-1]
        translation, rotation = errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation),
                                       self.robot.truth[pose.header.stamp.to_nsec()])
        self.assertLess(translation, 0.02)
        self.assertLess(rotation, 0.01)

    def assert_refused(self, message, expected):
        status = self.recorder.wait_for_status(lambda s: 'initialpose refused' in s.message, 20.0,
                                               do=lambda: self.recorder.set_pose(message))
        self.assertIsNotNone(status, self.recorder.history())
        self.assertIn(expected, status.message)
        self.assertEqual(status.reason, Status.REASON_NO_START_POSE)
        self.assertEqual(status.state, Status.WAITING_FOR_POSE)

    def test_a_click_in_rviz_is_refined(self):
        T = self.robot.T_map_base.copy()
        T[:3, 3] += [0.25, -0.2, -0.3]
        T[:3, :3] = room.rotation(0.5 + 0.2)
        # rviz's own covariance: nothing for z, roll and pitch.
        self.recorder.set_pose(pose_message(T, stamp=rospy.Time.now(), sigma=(0.5, 0.5, 0, 0, 0, np.pi / 12)))
        self.assert_tracks()

    def test_another_frame_is_transformed(self):
        T_odom_base = np.linalg.inv(self.robot.T_map_odom) @ self.robot.T_map_base
        # map -> odom must be known for that: track first.
        self.recorder.set_pose(pose_message(self.robot.T_map_base))
        self.assert_tracks()
        message = pose_message(T_odom_base, frame='/odom', stamp=rospy.Time.now())
        self.assertIsNotNone(self.recorder.wait_for_status(lambda s: 'initialpose taken' in s.message,
                                                           do=lambda: self.recorder.set_pose(message)),
                             self.recorder.history())
        self.assert_tracks()

    def test_an_empty_frame_warns_and_is_the_map(self):
        message = pose_message(self.robot.T_map_base, frame='')
        self.assertIsNotNone(self.recorder.wait_for_status(lambda s: 'no frame_id' in s.message,
                                                           do=lambda: self.recorder.set_pose(message)),
                             self.recorder.history())
        self.assert_tracks()

    def test_an_unknown_frame_is_refused(self):
        self.assert_refused(pose_message(self.robot.T_map_base, frame='moon'), 'moon')

    def test_nan_is_refused(self):
        message = pose_message(self.robot.T_map_base)
        message.pose.pose.position.x = float('nan')
        self.assert_refused(message, 'not finite')

    def test_a_zero_quaternion_is_refused(self):
        message = pose_message(self.robot.T_map_base)
        q = message.pose.pose.orientation
        q.x = q.y = q.z = q.w = 0.0
        self.assert_refused(message, 'quaternion')

    def test_a_bad_covariance_is_refused(self):
        for index, value in ((0, -1.0), (7, float('nan')), (1, 5.0)):
            message = pose_message(self.robot.T_map_base)
            covariance = list(message.pose.covariance)
            covariance[index] = value
            message.pose.covariance = covariance
            self.assert_refused(message, 'covariance')

    def test_the_motion_since_an_old_stamp_is_added(self):
        self.robot.velocity = 0.4
        old = {}

        def remember():
            stamps = sorted(self.robot.truth)
            if len(stamps) > 25:
                old['stamp'] = stamps[-25]
            return old and errors(self.robot.truth[old['stamp']], self.robot.T_map_base)[0] > 0.25
        self.assertTrue(self.recorder.wait_for(remember))
        # A tight covariance: only the motion since then explains where the robot is now.
        T = self.robot.truth[old['stamp']]
        self.recorder.set_pose(pose_message(T, stamp=rospy.Time(0, old['stamp'])))
        self.assert_tracks()

    def test_a_pose_without_covariance_is_searched_around(self):
        T = self.robot.T_map_base.copy()
        T[:3, 3] += [0.2, 0.2, 0.0]
        self.recorder.set_pose(pose_message(T, sigma=[0.0] * 6))
        self.assert_tracks()

    def test_a_wrong_pose_is_given_up_with_a_reason(self):
        message = pose_message(room.pose(5.2, 3.0, 0.0, 2.6), sigma=[0.01] * 6)
        taken = self.recorder.wait_for_status(lambda s: s.state == Status.RELOCALIZING,
                                              do=lambda: self.recorder.set_pose(message))
        self.assertIsNotNone(taken, self.recorder.history())
        status = self.recorder.wait_for_status(lambda s: s.state == Status.WAITING_FOR_POSE)
        self.assertIsNotNone(status, self.recorder.history())
        self.assertNotEqual(status.message, '')


if __name__ == '__main__':
    rospy.init_node('initialpose_test')
    rostest.rosrun('ttsdf_localization', 'initialpose', InitialPose)
