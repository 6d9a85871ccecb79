#!/usr/bin/env python3
"""Bad clouds are counted and reported, give no pose, and harm nothing."""

import struct

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import PointCloud2, PointField
from tf2_msgs.msg import TFMessage

from fake_robot import START, RobotTestCase, Status, cloud_message, pose_message, transform

END_OF_TIME = rospy.Time(4294967295, 0)


class BadClouds(RobotTestCase):
    def tearDown(self):
        # Whatever came in: the next good cloud gives a pose.
        self.robot.send_clouds = True
        poses = len(self.recorder.poses)
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.poses) > poses + 2), self.recorder.history())

    def status_of(self, cloud, reason):
        """Sends one bad cloud (odometry goes on) and returns the status with the reason."""
        self.robot.send_clouds = False
        poses = len(self.recorder.poses)
        status = self.recorder.wait_for_status(lambda s: s.reason == reason, 20.0,
                                               do=lambda: self.robot.publish_cloud(cloud))
        self.assertIsNotNone(status, self.recorder.history())
        self.assertFalse(status.pose_valid)
        self.assertGreater(status.refused, 0)
        self.assertLessEqual(len(self.recorder.poses), poses + 1)  # one good cloud may have been on its way
        return status

    def good(self):
        return cloud_message(self.robot.points(), 'camera', rospy.Time.now())

    def test_empty_cloud(self):
        self.status_of(cloud_message(np.zeros((0, 3)), 'camera', rospy.Time.now()), Status.REASON_TOO_FEW_POINTS)

    def test_empty_message(self):
        cloud = PointCloud2()
        cloud.header.frame_id = 'camera'
        cloud.header.stamp = rospy.Time.now()
        self.status_of(cloud, Status.REASON_TOO_FEW_POINTS)

    def test_all_nan(self):
        self.status_of(cloud_message(np.full((48, 64, 3), np.nan), 'camera', rospy.Time.now()),
                       Status.REASON_TOO_FEW_POINTS)

    def test_a_billion_metres_away(self):
        self.status_of(cloud_message(np.full((48, 64, 3), 1e9), 'camera', rospy.Time.now()),
                       Status.REASON_TOO_FEW_POINTS)

    def test_no_xyz(self):
        cloud = self.good()
        for field in cloud.fields:
            field.name = 'not_' + field.name
        status = self.status_of(cloud, Status.REASON_BAD_CLOUD)
        self.assertIn("no field 'x'", status.message)
        self.assertIn('not_x', status.message)

    def test_integers(self):
        cloud = self.good()
        for field in cloud.fields:
            field.datatype = PointField.INT32
        self.assertIn('datatype', self.status_of(cloud, Status.REASON_BAD_CLOUD).message)

    def test_data_cut_off(self):
        cloud = self.good()
        cloud.data = cloud.data[:-1]
        self.assertIn('bytes of data', self.status_of(cloud, Status.REASON_BAD_CLOUD).message)

    def test_absurd_sizes(self):
        cloud = self.good()
        cloud.width = cloud.height = cloud.point_step = cloud.row_step = 0xFFFFFFFF
        self.status_of(cloud, Status.REASON_BAD_CLOUD)

    def test_stamp_zero(self):
        cloud = self.good()
        cloud.header.stamp = rospy.Time()
        self.assertIn('stamp 0', self.status_of(cloud, Status.REASON_BAD_CLOUD).message)

    def test_stamp_in_the_future(self):
        cloud = self.good()
        cloud.header.stamp = rospy.Time.now() + rospy.Duration(1000.0)
        self.assertIn('future', self.status_of(cloud, Status.REASON_BAD_CLOUD).message)

    def test_stamp_at_the_end_of_time(self):
        cloud = self.good()
        cloud.header.stamp = END_OF_TIME
        status = self.status_of(cloud, Status.REASON_BAD_CLOUD)
        self.assertIn('future', status.message)
        self.assertIn('4294967295', status.message)

    def test_a_transform_at_the_end_of_time_is_left_out(self):
        publisher = rospy.Publisher('/tf', TFMessage, queue_size=5)
        self.assertTrue(self.recorder.wait_for(lambda: publisher.get_num_connections() > 1))
        far = transform('odom', 'base_link', START, END_OF_TIME)
        status = self.recorder.wait_for_status(lambda s: 'left out' in s.message, 20.0,
                                               do=lambda: publisher.publish(TFMessage([far])))
        self.assertIsNotNone(status, self.recorder.history())
        self.assertIn("'odom' -> 'base_link'", status.message)
        self.assertIn('4294967295', status.message)
        self.assertEqual(status.state, Status.TRACKING)
        self.assertIsNone(self.recorder.wait_for_status(lambda s: s.state != Status.TRACKING, 2.0))

    def test_a_transform_of_another_year_is_got_over(self):
        publisher = rospy.Publisher('/tf', TFMessage, queue_size=5)
        self.assertTrue(self.recorder.wait_for(lambda: publisher.get_num_connections() > 1))
        far = transform('odom', 'base_link', START, rospy.Time(3000000000))  # tf2 can compare it with the others
        status = self.recorder.wait_for_status(lambda s: s.reason == Status.REASON_TIME_JUMP, 20.0,
                                               do=lambda: publisher.publish(TFMessage([far])))
        self.assertIsNotNone(status, self.recorder.history())

    def test_a_start_pose_at_the_end_of_time_is_taken_for_now(self):
        pose = pose_message(self.robot.T_map_base, stamp=END_OF_TIME)
        status = self.recorder.wait_for_status(lambda s: 'initialpose taken' in s.message, 20.0,
                                               do=lambda: self.recorder.set_pose(pose))
        self.assertIsNotNone(status, self.recorder.history())
        self.assertIn('4294967295', status.message)
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING), self.recorder.history())

    def test_stamp_of_long_ago(self):
        cloud = self.good()
        cloud.header.stamp = rospy.Time.now() - rospy.Duration(1000.0)
        self.assertIn('older', self.status_of(cloud, Status.REASON_NO_TRANSFORM).message)

    def test_the_same_scan_twice(self):
        cloud = self.good()
        self.pose_of(cloud)
        status = self.status_of(cloud, Status.REASON_OLD_STAMP)
        self.assertIn('not newer', status.message)
        self.assertEqual(status.header.stamp, cloud.header.stamp)
        self.assertEqual(status.state, Status.TRACKING)

    def test_no_frame(self):
        cloud = self.good()
        cloud.header.frame_id = ''
        self.assertIn('frame_id', self.status_of(cloud, Status.REASON_BAD_CLOUD).message)

    def pose_of(self, cloud):
        """Other formats are good clouds: they give a pose."""
        self.robot.send_clouds = False
        stamp = cloud.header.stamp
        self.robot.publish_cloud(cloud)
        self.assertTrue(self.recorder.wait_for(lambda: any(p.header.stamp == stamp for p in self.recorder.poses), 20.0),
                        self.recorder.history())

    def test_big_endian_is_read(self):
        cloud = self.good()
        cloud.is_bigendian = True
        cloud.data = self.robot.points().astype('>f4').tobytes()
        self.pose_of(cloud)

    def test_float64_is_read(self):
        cloud = self.good()
        for n, field in enumerate(cloud.fields):
            field.datatype, field.offset = PointField.FLOAT64, 8 * n
        cloud.point_step, cloud.row_step = 24, 24 * cloud.width
        cloud.data = self.robot.points().astype(np.float64).tobytes()
        self.pose_of(cloud)

    def test_padded_and_unaligned_points_are_read(self):
        cloud = self.good()
        for n, field in enumerate(cloud.fields):
            field.offset = 1 + 4 * n
        cloud.point_step, cloud.row_step = 15, 15 * cloud.width + 7
        rows = [b''.join(b'\xff' + struct.pack('<fff', *p) + b'\xff\xff' for p in row) + b'\xff' * 7
                for row in self.robot.points()]
        cloud.data = b''.join(rows)
        self.pose_of(cloud)

    def test_a_leading_slash_is_stripped(self):
        cloud = self.good()
        cloud.header.frame_id = '/camera'
        self.pose_of(cloud)


if __name__ == '__main__':
    rospy.init_node('bad_clouds_test')
    rostest.rosrun('ttsdf_localization', 'bad_clouds', BadClouds)
