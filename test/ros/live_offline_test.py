#!/usr/bin/env python3
"""The same bag, played to the node and read by offline_localizer, gives the same poses: odometry that comes late and drops
out is treated alike."""

import os
import subprocess
import tempfile
import unittest

import numpy as np
import rosbag
import roslib.packages
import rospy
import rostest
from tf2_msgs.msg import TFMessage

import room
from fake_robot import START, Recorder, cloud_message, transform

SCANS, RATE, START_TIME = 60, 10.0, 1000.0
LATE = 0.15                 # [s] that odometry comes after its stamp
DROPPED = range(30, 45)     # scans without odometry


def write_bag(path):
    T_map_odom = room.pose(0.3, -0.2, 0.0, 0.1)
    messages = []
    for n in range(SCANS):
        t = START_TIME + n / RATE
        stamp = rospy.Time.from_sec(t)
        T = START @ room.pose(0.01 * n, 0.0, 0.0, 0.01 * n)
        messages.append((t + 0.02, 'cloud', cloud_message(room.scan(T @ room.T_BASE_CAMERA), 'camera', stamp)))
        if n not in DROPPED:
            messages.append((t + LATE, '/tf', TFMessage([transform('odom', 'base_link', np.linalg.inv(T_map_odom) @ T, stamp)])))
    mount = TFMessage([transform('base_link', 'camera', room.T_BASE_CAMERA, rospy.Time.from_sec(START_TIME))])
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/tf_static', mount, rospy.Time.from_sec(START_TIME))
        for t, topic, message in sorted(messages, key=lambda entry: entry[0]):
            bag.write(topic, message, rospy.Time.from_sec(t))


class LiveOffline(unittest.TestCase):
    def test_a_bag_gives_the_same_poses(self):
        recorder = Recorder()
        with tempfile.TemporaryDirectory() as folder:
            bag, out = os.path.join(folder, 'run.bag'), os.path.join(folder, 'out.tum')
            write_bag(bag)
            offline = roslib.packages.find_node('ttsdf_localization', 'offline_localizer')[0]
            done = subprocess.run([offline, bag, '--map', rospy.get_param('~map'), '--trajectory', out,
                                   '--set', 'set_initial_pose=true', '--set', 'initial_pose_x=1.6',
                                   '--set', 'initial_pose_y=1.2', '--set', 'initial_pose_yaw=0.5'],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout)
            expected = {round(float(line.split()[0]), 3): np.array(line.split()[1:4], float) for line in open(out)}
            self.assertGreater(len(expected), SCANS - 4)
            self.assertTrue(recorder.wait_for(lambda: any(s.map_id for s in recorder.statuses)), 'no map')
            subprocess.run(['rosbag', 'play', '--clock', '--hz=200', '--quiet', '--delay=2', bag], timeout=100, check=True)
            recorder.wait_for(lambda: recorder.poses and
                              recorder.poses[-1].header.stamp.to_sec() > START_TIME + (SCANS - 2) / RATE, 10.0)
        same = 0
        for pose in recorder.poses:
            p = pose.pose.pose.position
            wanted = expected.get(round(pose.header.stamp.to_sec(), 3))
            if wanted is not None:
                self.assertLess(np.linalg.norm(np.array([p.x, p.y, p.z]) - wanted), 1e-3, pose.header.stamp.to_sec())
                same += 1
        # On a busy machine a scan may be overtaken.
        self.assertGreaterEqual(same, 0.9 * len(expected), recorder.history())


if __name__ == '__main__':
    rospy.init_node('live_offline_test')
    rostest.rosrun('ttsdf_localization', 'live_offline', LiveOffline)
