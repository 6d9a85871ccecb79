#!/usr/bin/env python3
"""Maps come out of an atlas: the pose asks for them, tracking works in all of them at once, diagnostics name them."""

import unittest

import rospy
import rostest

from fake_robot import FakeRobot, Recorder, Status, pose_message


class AtlasOfMaps(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recorder = Recorder()
        cls.robot = FakeRobot().start()

    @classmethod
    def tearDownClass(cls):
        cls.robot.stop()

    def atlas_diagnostics(self):
        return next((s for name, s in self.recorder.diagnostics.items() if name.endswith(': atlas')), None)

    def test_maps_are_loaded_where_somebody_says_the_robot_is(self):
        self.assertTrue(self.robot.wait_for_subscriber(), 'nobody subscribes to the cloud')
        self.recorder.wait_for_initialpose_connection()
        self.recorder.set_pose(pose_message(self.robot.T_map_base))
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING), self.recorder.history())
        # Both maps of the room, one after the other; the state does not change when the second one comes.
        both = self.recorder.wait_for_status(lambda s: s.pose_valid and '+' in s.map_id)
        self.assertIsNotNone(both, self.recorder.history())
        states = [s.state for s in self.recorder.statuses]
        self.assertEqual(set(states[states.index(Status.TRACKING):]), {Status.TRACKING}, self.recorder.history())

        self.assertTrue(self.recorder.wait_for(lambda: self.atlas_diagnostics() is not None and
                                               self.atlas_diagnostics().message == '2 maps in use'),
                        self.atlas_diagnostics())
        values = {v.key: v.value for v in self.atlas_diagnostics().values}
        self.assertEqual(set(values['in use'].split()), {'room', 'room_rank_25'})

        count = len(self.recorder.poses)
        self.robot.velocity = 0.2
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.poses) > count + 20), self.recorder.history())
        self.robot.velocity = 0.0
        self.assertEqual(self.recorder.state(), Status.TRACKING)


if __name__ == '__main__':
    rospy.init_node('atlas_test')
    rostest.rosrun('ttsdf_localization', 'atlas', AtlasOfMaps)
