#!/usr/bin/env python3
"""Nobody says where the robot is: it is found in the map of the atlas that it is in, and a twin is not guessed."""

import unittest

import rospy
import rostest

from fake_robot import FakeRobot, Recorder, Status, errors, matrix
from ttsdf_localization.srv import GlobalLocalization

ROOM_AT = 30.0    # [m] along x: the room in the atlas with the hall, and the twin


class GlobalOverAnAtlas(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot().start()
        cls.hall, cls.twins = Recorder('hall'), Recorder('twins')

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


if __name__ == '__main__':
    rospy.init_node('atlas_global_test')
    rostest.rosrun('ttsdf_localization', 'atlas_global', GlobalOverAnAtlas)
