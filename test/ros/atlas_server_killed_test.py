#!/usr/bin/env python3
"""The server of an atlas dies, or stops to answer, while the robot drives: it goes on with the maps that it has, says what is
missing once it gets to where another map is needed, and has that map when the server is there again."""

import signal
import subprocess
import unittest

import roslib.packages
import rospy
import rostest

from fake_robot import FakeRobot, Recorder, Status, pose_message, start_tracking

TWIN_AT = 30.0    # [m] along x: the second map, which looks the same


class ServerDiesInADrive(unittest.TestCase):
    def setUp(self):
        program = roslib.packages.find_node('ttsdf_localization', 'map_server_node')[0]
        self.command = [program, rospy.get_param('~map_dir') + '/twins', '__name:=server']
        self.server = subprocess.Popen(self.command)
        self.recorder = Recorder()
        self.robot = FakeRobot().start()

    def tearDown(self):
        self.robot.stop()
        self.kill()

    def kill(self):
        self.server.send_signal(signal.SIGKILL)
        self.server.wait()

    def diagnosis(self):
        status = next((s for name, s in self.recorder.diagnostics.items() if name.endswith(': atlas')), None)
        return '' if status is None else ' '.join([status.message] + [v.key + ' ' + v.value for v in status.values])

    def maps_in_use(self):
        status = next((s for name, s in self.recorder.diagnostics.items() if name.endswith(': atlas')), None)
        return {v.key: v.value for v in status.values}.get('in use') if status else None

    def place_at(self, x):
        T = self.robot.T_map_base.copy()
        T[0, 3] += x
        self.recorder.set_pose(pose_message(T))

    def drives_on(self):
        count = len(self.recorder.poses)
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.poses) > count + 10), self.recorder.history())
        self.assertEqual(self.recorder.state(), Status.TRACKING)

    def tracked_in(self, name, x):
        self.assertTrue(self.recorder.wait_for(lambda: self.maps_in_use() == name), self.diagnosis())
        self.place_at(x)    # the one before may have been given up meanwhile
        self.assertIsNotNone(self.recorder.wait_for_status(lambda s: s.pose_valid), self.recorder.history())
        count = len(self.recorder.poses)
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.poses) > count + 5), self.recorder.history())
        off = self.recorder.poses[-1].pose.pose.position.x - x - self.robot.truth[
            self.recorder.poses[-1].header.stamp.to_nsec()][0, 3]
        self.assertLess(abs(off), 0.05)

    def test_frozen_and_killed(self):
        start_tracking(self, self.recorder, self.robot)
        self.robot.velocity = 0.2
        self.tracked_in('room', 0.0)

        self.server.send_signal(signal.SIGSTOP)
        self.drives_on()
        self.place_at(TWIN_AT)    # as if the robot had driven there: only the server has this map
        self.assertTrue(self.recorder.wait_for(lambda: 'no answer within' in self.diagnosis()), self.diagnosis())
        self.assertIn('twin', self.diagnosis())

        self.kill()
        self.assertTrue(self.recorder.wait_for(lambda: 'is not there' in self.diagnosis()), self.diagnosis())
        self.server = subprocess.Popen(self.command)
        self.tracked_in('twin', TWIN_AT)

        self.kill()
        self.drives_on()


if __name__ == '__main__':
    rospy.init_node('atlas_server_killed_test')
    rostest.rosrun('ttsdf_localization', 'atlas_server_killed', ServerDiesInADrive)
