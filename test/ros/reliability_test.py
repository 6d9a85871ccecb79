#!/usr/bin/env python3
"""A short run of fault_run: every kind of fault some times, in simulated time (scripts/reliability runs it for long)."""

import subprocess
import unittest

import roslib.packages
import rospy
import rostest


class Reliability(unittest.TestCase):
    def test_faults_at_random_do_no_harm(self):
        folder = rospy.get_param('~map_dir')
        program = roslib.packages.find_node('ttsdf_localization', 'fault_run')[0]
        done = subprocess.run([program, '--map', folder + '/room.ttsdf', '--other-map', folder + '/room_rank_25.ttsdf',
                               '--scans', '1500', '--one-in', '5', '--speed', '4'], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, universal_newlines=True, timeout=250, check=False)
        print(done.stdout)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr[-3000:])


if __name__ == '__main__':
    rospy.init_node('reliability_test', disable_rostime=True)
    rostest.rosrun('ttsdf_localization', 'reliability', Reliability)
