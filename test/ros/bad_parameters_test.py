#!/usr/bin/env python3
"""Bad parameters: the node ends with a message, the nodelet says so and its manager lives."""

import os
import subprocess
import tempfile
import unittest

import roslib.packages
import rospy
import rostest

from fake_robot import Recorder, Status


class BadParameters(unittest.TestCase):
    def test_node_refuses_to_start(self):
        node = roslib.packages.find_node('ttsdf_localization', 'localization_node')[0]
        for argument, expected in (('_gates/min_inlier_ration:=0.5', 'min_inlier_ratio'),
                                   ('_transform_tolerance:=-1.0', 'transform_tolerance'),
                                   ('_base_frame_id:=map', 'base_frame_id')):
            key = argument[1:].split(':=')[0]
            done = subprocess.run([node, '__name:=refused', argument], capture_output=True, timeout=60.0,
                                  env=dict(os.environ), check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn(expected, (done.stdout + done.stderr).decode())
            rospy.delete_param('/refused/' + key)

    def test_a_missing_map_file_is_said_once_and_where_it_was_looked_for(self):
        node = roslib.packages.find_node('ttsdf_localization', 'localization_node')[0]
        recorder = Recorder(namespace='lost_file')
        with tempfile.TemporaryDirectory() as folder:
            process = subprocess.Popen([node, '__name:=localization', '__ns:=lost_file', '_map_file:=no_such.ttsdf'],
                                       cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            try:
                status = recorder.wait_for(lambda: any('no_such' in s.message for s in recorder.statuses))
                self.assertTrue(status, recorder.history())
            finally:
                process.terminate()
                output = process.communicate(timeout=30.0)[0].decode()
            message = next(s.message for s in recorder.statuses if 'no_such' in s.message)
            self.assertIn("relative path, looked up in '%s'" % os.path.realpath(folder), message)
        self.assertEqual(output.count('no_such.ttsdf'), 1, output)
        rospy.delete_param('/lost_file/localization/map_file')

    def test_nodelet_says_so_and_the_manager_lives(self):
        bad, good = Recorder(namespace='bad'), Recorder(namespace='good')
        self.assertTrue(bad.wait_for_state(Status.ERROR), bad.history())
        status = bad.statuses[-1]
        self.assertEqual(status.reason, Status.REASON_PARAMETER)
        self.assertIn('max_rms_residual', status.message)
        self.assertIn('small', status.message)
        self.assertTrue(good.wait_for(lambda: any(s.map_id for s in good.statuses)), good.history())


if __name__ == '__main__':
    rospy.init_node('bad_parameters_test')
    rostest.rosrun('ttsdf_localization', 'bad_parameters', BadParameters)
