#!/usr/bin/env python3
"""The map is replaced while the robot is localized; a bad one changes nothing."""

import os
import subprocess
import sys
import tempfile

import rospy
import rostest

from fake_robot import RobotTestCase, Status, errors, matrix, pose_message
from ttsdf_localization.msg import TtSdfMap
from ttsdf_localization.srv import LoadMap, SetMap


class MapChange(RobotTestCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.maps = rospy.get_param('~map_dir')

    def setUp(self):
        super().setUp()
        rospy.wait_for_service('localization/load_map', 30.0)
        self.load = rospy.ServiceProxy('localization/load_map', LoadMap)
        self.set_map = rospy.ServiceProxy('localization/set_map', SetMap)

    def map_id(self):
        return self.recorder.statuses[-1].map_id

    def assert_still_tracking(self, map_id):
        # A status of the map before may still be on its way.
        status = self.recorder.wait_for_status(lambda s: s.pose_valid and s.map_id == map_id)
        self.assertIsNotNone(status, self.recorder.history())

    def refused(self, data, expected):
        before = self.map_id()
        with tempfile.NamedTemporaryFile(suffix='.ttsdf') as file:
            file.write(data)
            file.flush()
            reply = self.load(file.name)
        self.assertFalse(reply.success)
        self.assertIn(expected, reply.message)
        self.assertIn(file.name, reply.message)
        self.assert_still_tracking(before)

    def read(self, name):
        with open(os.path.join(self.maps, name), 'rb') as file:
            return file.read()

    def test_replaced_a_hundred_times_under_load_without_losing_the_pose(self):
        """While the robot drives, and two processes keep the processors busy."""
        self.robot.velocity = 0.3
        busy = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(2)]
        try:
            self.replace(100)
        finally:
            self.robot.velocity = 0.0
            for process in busy:
                process.kill()
                process.wait()

    def replace(self, times):
        begin, poses = len(self.recorder.statuses), len(self.recorder.poses)
        ids = set()
        for n in range(times):
            reply = self.load(os.path.join(self.maps, ('room.ttsdf', 'room_rank_25.ttsdf')[n % 2]))
            self.assertTrue(reply.success, reply.message)
            ids.add(reply.map_id)
            self.assert_still_tracking(reply.map_id)
        self.assertEqual(len(ids), 2)
        states = {s.state for s in self.recorder.statuses[begin:]}
        self.assertEqual(states, {Status.TRACKING}, self.recorder.history())
        for pose in self.recorder.poses[poses:]:
            truth = self.robot.truth[pose.header.stamp.to_nsec()]
            self.assertLess(errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)[0], 0.03)

    def test_a_truncated_file_is_refused(self):
        self.refused(self.read('room.ttsdf')[:-100], 'wanted')

    def test_a_flipped_bit_is_refused(self):
        data = bytearray(self.read('room.ttsdf'))
        data[len(data) // 2] ^= 0x10
        self.refused(bytes(data), '')

    def test_a_foreign_file_is_refused(self):
        self.refused(b'ply\nformat ascii 1.0\n' * 50, '')

    def test_an_empty_file_is_refused(self):
        self.refused(b'', '')

    def test_a_missing_file_is_refused(self):
        before = self.map_id()
        reply = self.load('/no/such/file.ttsdf')
        self.assertFalse(reply.success)
        self.assertIn('/no/such/file.ttsdf', reply.message)
        self.assert_still_tracking(before)

    def test_set_map_takes_the_bytes_and_a_pose(self):
        message = TtSdfMap()
        message.data = self.read('room_rank_25.ttsdf')
        reply = self.set_map(message, True, pose_message(self.robot.T_map_base))
        self.assertTrue(reply.success, reply.message)
        self.assertTrue(self.recorder.wait_for(lambda: self.map_id() == reply.map_id))
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING), self.recorder.history())

    def test_set_map_with_bad_bytes_or_a_bad_pose_changes_nothing(self):
        before = self.map_id()
        message = TtSdfMap()
        message.data = self.read('room.ttsdf')[:1000]
        self.assertFalse(self.set_map(message, False, pose_message(self.robot.T_map_base)).success)
        message.data = self.read('room.ttsdf')
        bad = pose_message(self.robot.T_map_base)
        bad.pose.pose.orientation.w = float('nan')
        self.assertFalse(self.set_map(message, True, bad).success)
        self.assert_still_tracking(before)


if __name__ == '__main__':
    rospy.init_node('map_change_test')
    rostest.rosrun('ttsdf_localization', 'map_change', MapChange)
