#!/usr/bin/env python3
"""map -> odom: stamps rise and never repeat, it is sent again between scans, and it stops when the pose is lost."""


import rospy
import rostest

import room
from fake_robot import RobotTestCase, Status, pose_message


class TfOutput(RobotTestCase):
    def stamps(self, begin=0):
        return [t.header.stamp for t in self.recorder.transforms[begin:]]

    def test_stamps_rise_strictly(self):
        begin = len(self.recorder.transforms)
        self.assertTrue(self.recorder.wait_for_new(self.recorder.transforms, 100))
        stamps = self.stamps(begin)
        for earlier, later in zip(stamps, stamps[1:]):
            self.assertLess(earlier, later)

    def test_some_are_stamped_exactly_a_tolerance_ahead_of_a_scan(self):
        self.assertTrue(self.recorder.wait_for(
            lambda: any((t - rospy.Duration(0.1)).to_nsec() in self.robot.truth for t in self.stamps())))

    def test_it_is_sent_at_20_hz_at_least_without_scans(self):
        self.robot.send_clouds = False
        r = self.recorder
        self.assertTrue(r.wait_for_new(r.transforms, 10))
        begin = len(r.transforms)
        self.assertTrue(r.wait_for_new(r.transforms, 60))
        # In the clock of the stamps: what the test's own thread did meanwhile does not matter.
        stamps = self.stamps(begin)
        self.assertGreaterEqual((len(stamps) - 1) / (stamps[-1] - stamps[0]).to_sec(), 20.0)
        self.assertEqual(r.state(), Status.DEGRADED)  # the camera is silent, and that is said

    def test_consumers_need_not_wait(self):
        """A transform dated ahead is there before its time comes."""
        r = self.recorder
        self.assertTrue(r.wait_for(lambda: r.transforms and r.transforms[-1].header.stamp > rospy.Time.now()))

    def test_nothing_is_sent_while_the_pose_is_unknown(self):
        r = self.recorder
        # A start pose that is wrong: the state is known at once, and the transform stops at once.
        wrong = pose_message(room.pose(5.0, 3.0, 0.0, 2.5), sigma=[0.01] * 6)
        self.assertIsNotNone(r.wait_for_status(lambda s: s.state == Status.RELOCALIZING, do=lambda: r.set_pose(wrong)))
        begin = len(r.transforms)
        self.assertIsNotNone(r.wait_for_status(lambda s: s.state == Status.WAITING_FOR_POSE), r.history())
        # One may have been on its way.
        self.assertLessEqual(len(r.transforms) - begin, 1)
        self.assertIsNotNone(r.wait_for_status(lambda s: not s.pose_valid))
        self.assertLessEqual(len(r.transforms) - begin, 1)


if __name__ == '__main__':
    rospy.init_node('tf_output_test')
    rostest.rosrun('ttsdf_localization', 'tf_output', TfOutput)
