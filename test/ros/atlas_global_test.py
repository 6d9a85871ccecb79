#!/usr/bin/env python3
"""Nobody says where the robot is: it is found in the map of the atlas that it is in, and a twin is not guessed but decided by
motion, where that tells them apart."""

import unittest

import rospy
import rostest

import room
from fake_robot import FakeRobot, Recorder, Status, errors, matrix
from ttsdf_localization.srv import GlobalLocalization

ROOM_AT = 30.0    # [m] along x: the room in the atlas with the hall, and the twin


class GlobalOverAnAtlas(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot().start()
        cls.hall, cls.twins, cls.alike = Recorder('hall'), Recorder('twins'), Recorder('alike')

    @classmethod
    def tearDownClass(cls):
        cls.robot.stop()

    def locate(self, recorder):
        """The answer of ~global_localization, asked when the node has scans and a first map."""
        self.assertTrue(recorder.wait_for(lambda: any(s.map_id for s in recorder.statuses), timeout=30.0), recorder.history())
        rospy.wait_for_service(recorder.private + '/global_localization', 30.0)
        call = rospy.ServiceProxy(recorder.private + '/global_localization', GlobalLocalization)
        answer = call(cancel=False, wait=True)
        for _ in range(100):
            if 'no scan yet' not in answer.message and 'running already' not in answer.message:
                break
            recorder.wait_for_new(recorder.statuses, timeout=0.2)
            answer = call(cancel=False, wait=True)
        return answer

    def test_the_robot_is_found_in_a_map_that_was_not_loaded(self):
        answer = self.locate(self.hall)
        self.assertTrue(answer.success, answer.message + ' | ' + self.hall.history())
        truth = self.robot.T_map_base.copy()
        truth[0, 3] += ROOM_AT
        pose = answer.pose.pose.pose
        distance, angle = errors(matrix(pose.position, pose.orientation), truth)
        self.assertLess(distance, 0.05)
        self.assertLess(angle, 0.05)
        self.assertTrue(self.hall.wait_for_state(Status.TRACKING), self.hall.history())
        # The hall is too far away to be of use here.
        self.assertTrue(self.hall.wait_for(lambda: self.hall.statuses[-1].map_id and
                                           '+' not in self.hall.statuses[-1].map_id), self.hall.history())

    def test_twins_are_named_and_no_pose_is_taken(self):
        answer = self.locate(self.twins)
        self.assertFalse(answer.success)
        self.assertIn('room', answer.message)
        self.assertIn('twin', answer.message)
        self.assertFalse(self.twins.poses)

    def test_z_looking_round_decides_between_rooms_that_differ(self):
        answer = self.locate(self.alike)
        self.assertFalse(answer.success)
        for words in ('room', 'other', 'goes on when the robot drives'):
            self.assertIn(words, answer.message)
        self.assertFalse(self.alike.poses)
        # Cancelled, it does not go on.
        call = rospy.ServiceProxy(self.alike.private + '/global_localization', GlobalLocalization)
        self.assertTrue(call(cancel=True, wait=False).success)
        self.robot.T_map_base = room.pose(1.6, 1.2, 0.0, 0.0)
        self.assertTrue(self.alike.wait_for_new(self.alike.statuses, 10))
        self.assertFalse(call(cancel=True, wait=False).success)
        self.robot.T_map_base = room.pose(1.6, 1.2, 0.0, 0.5)
        self.assertIn('goes on', self.locate(self.alike).message)
        # Round on the spot: the cupboard, which stands elsewhere in the other room, comes into view.
        for n in range(1, 120):
            self.robot.T_map_base = room.pose(1.6, 1.2, 0.0, 0.5 + 0.1 * n)
            if self.alike.wait_for_state(Status.TRACKING, timeout=0.4):
                break
        self.assertEqual(self.alike.state(), Status.TRACKING, self.alike.history())
        self.assertTrue(self.alike.wait_for_new(self.alike.poses, 3), self.alike.history())
        message = self.alike.poses[-1]
        pose = message.pose.pose
        distance, angle = errors(matrix(pose.position, pose.orientation), self.robot.truth[message.header.stamp.to_nsec()])
        self.assertLess(distance, 0.05)
        self.assertLess(angle, 0.05)
        # Where nothing differs, no motion tells.
        self.assertFalse(self.twins.poses, self.twins.history())


if __name__ == '__main__':
    rospy.init_node('atlas_global_test')
    rostest.rosrun('ttsdf_localization', 'atlas_global', GlobalOverAnAtlas)
