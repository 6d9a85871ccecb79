#!/usr/bin/env python3
"""A robot is localized: pose, covariance, TF, odometry, status, services, and what is published on demand."""

import time

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger

import room
from fake_robot import RobotTestCase, Status, errors, matrix, pose_message
from ttsdf_localization.srv import GlobalLocalization, Relocalize


class Localization(RobotTestCase):
    def service(self, name, kind):
        name = self.recorder.private + '/' + name
        rospy.wait_for_service(name, 30.0)
        return rospy.ServiceProxy(name, kind)

    def test_pose_and_tf_agree_with_the_truth(self):
        r = self.recorder
        self.robot.velocity = 0.3
        self.assertTrue(r.wait_for_new(r.poses, 20), r.history())
        for pose in r.poses[-15:]:
            truth = self.robot.truth[pose.header.stamp.to_nsec()]
            translation, rotation = errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)
            self.assertLess(translation, 0.02)
            self.assertLess(rotation, 0.01)
        t = r.transforms[-1].transform
        translation, rotation = errors(matrix(t.translation, t.rotation), self.robot.T_map_odom)
        self.assertLess(translation, 0.03)
        self.assertLess(rotation, 0.015)

    def test_covariance_holds_the_truth_within_three_sigma(self):
        r = self.recorder
        self.robot.velocity = 0.3
        begin = len(r.poses)
        self.assertTrue(r.wait_for_new(r.poses, 100), r.history())
        within = []
        for pose in r.poses[begin:]:
            truth = self.robot.truth[pose.header.stamp.to_nsec()]
            T = matrix(pose.pose.pose.position, pose.pose.pose.orientation)
            D = T[:3, :3] @ truth[:3, :3].T
            difference = np.hstack([(T - truth)[:3, 3], [D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]]])
            difference[3:] *= 0.5
            sigma = np.sqrt(np.diag(np.reshape(pose.pose.covariance, (6, 6))))
            within.append(np.all(np.abs(difference) < 3.0 * sigma))
        self.assertGreaterEqual(np.mean(within), 0.99)

    def test_covariance_is_honest_and_in_the_order_of_ros(self):
        r = self.recorder
        self.assertTrue(r.wait_for_new(r.poses, 3))
        pose = r.poses[-1]
        covariance = np.array(pose.pose.covariance).reshape(6, 6)
        self.assertTrue(np.allclose(covariance, covariance.T))
        self.assertGreater(np.linalg.eigvalsh(covariance)[0], 0.0)
        truth = self.robot.truth[pose.header.stamp.to_nsec()]
        T = matrix(pose.pose.pose.position, pose.pose.pose.orientation)
        self.assertLess(np.sqrt(np.abs(np.diag(covariance)[:3])).max(), 0.1)
        difference = np.abs((T - truth)[:3, 3])
        # The compressed map itself is off by some millimetres, which the scan cannot know.
        self.assertTrue(np.all(difference < 3.0 * np.sqrt(np.diag(covariance)[:3]) + 0.01), difference)

    def test_odometry_carries_pose_and_twist(self):
        r = self.recorder
        self.robot.velocity = 0.3
        self.assertTrue(r.wait_for_new(r.odometry, 6))
        message = r.odometry[-1]
        self.assertEqual(message.header.frame_id, 'map')
        self.assertEqual(message.child_frame_id, 'base_link')
        self.assertTrue(r.wait_for(lambda: abs(abs(r.odometry[-1].twist.twist.linear.x) - 0.3) < 0.15))

    def test_status_says_how_well_it_fits(self):
        status = self.recorder.wait_for_status(lambda s: s.pose_valid)
        self.assertEqual(status.state, Status.TRACKING)
        self.assertEqual(status.state_name, 'tracking')
        self.assertEqual(status.reason, Status.REASON_NONE)
        self.assertGreater(status.inlier_ratio, 0.9)
        self.assertLess(status.rms_residual, 0.02)
        self.assertEqual(status.outside_ratio, 0.0)
        self.assertGreater(status.iterations, 0)
        self.assertGreater(status.milliseconds, 0.0)
        self.assertGreater(status.hessian_eigenvalues[0], 0.0)
        self.assertEqual(sorted(status.hessian_eigenvalues), list(status.hessian_eigenvalues))
        self.assertEqual(len(status.map_id), 8)
        self.assertGreater(status.scans, 0)

    def test_a_late_subscriber_gets_the_last_pose(self):
        message = rospy.wait_for_message('pose', PoseWithCovarianceStamped, 30.0)
        self.assertEqual(message.header.frame_id, 'map')

    def test_aligned_cloud_lies_on_the_walls(self):
        cloud = rospy.wait_for_message('aligned_cloud', PointCloud2, 30.0)
        self.assertEqual(cloud.header.frame_id, 'map')
        points = np.frombuffer(cloud.data, np.float32).reshape(-1, 3)
        self.assertGreater(len(points), 1000)
        self.assertLess(np.percentile(np.abs(room.distance(points)), 90), 0.03)

    def test_path_is_kept_while_somebody_looks(self):
        paths = []
        subscriber = rospy.Subscriber('path', Path, lambda m: paths.append(m))
        self.robot.velocity = 0.3
        self.assertTrue(self.recorder.wait_for(lambda: paths and len(paths[-1].poses) >= 4))
        subscriber.unregister()

    def test_diagnostics_tell_rate_state_and_transform(self):
        r = self.recorder

        def level(task):
            return next((s for name, s in r.diagnostics.items() if name.endswith(task)), None)
        self.assertTrue(r.wait_for(lambda: all(level(t) is not None and level(t).level == 0 for t in
                                               ('localization', 'scans', 'transforms'))), str(r.diagnostics))
        self.assertTrue(r.wait_for(lambda: float({v.key: v.value for v in level('scans').values}['rate [Hz]']) > 0.0),
                        str(level('scans')))
        self.assertIn('map -> odom', level('transforms').message)

    def test_pause_and_go_on(self):
        pause = self.service('pause', SetBool)
        self.assertTrue(pause(True).success)
        self.assertTrue(self.recorder.wait_for_state(Status.PAUSED))
        count = len(self.recorder.transforms)
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.transforms) > count + 5))
        poses = len(self.recorder.poses)
        self.assertTrue(pause(False).success)
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.poses) > poses))

    def test_relocalize_finds_the_pose_around_a_guess(self):
        relocalize = self.service('relocalize', Relocalize)
        near = self.robot.T_map_base.copy()
        near[:3, 3] += [0.3, -0.2, 0.0]
        reply = relocalize(False, pose_message(near))
        self.assertTrue(reply.success, reply.message)
        translation, _ = errors(matrix(reply.pose.pose.pose.position, reply.pose.pose.pose.orientation),
                                self.robot.T_map_base)
        self.assertLess(translation, 0.02)
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING))
        far = pose_message(room.pose(5.0, 3.0, 0.0, 2.5), sigma=[0.01] * 6)
        reply = relocalize(False, far)
        self.assertFalse(reply.success)
        self.assertNotEqual(reply.message, '')
        reply = relocalize(True, pose_message(near))
        self.assertTrue(reply.success, reply.message)

    def test_global_localization_without_prior(self):
        find = self.service('global_localization', GlobalLocalization)
        reply = find(False, True)
        self.assertTrue(reply.success, reply.message)
        translation, rotation = errors(matrix(reply.pose.pose.pose.position, reply.pose.pose.pose.orientation),
                                       self.robot.T_map_base)
        self.assertLess(translation, 0.03)
        self.assertLess(rotation, 0.02)
        self.assertLess(reply.score, reply.runner_up_score)
        # Answered with a pose that is in use: the same that was published.
        published = PoseWithCovarianceStamped(header=reply.pose.header, pose=reply.pose.pose)
        r = self.recorder
        self.assertTrue(r.wait_for(lambda: any(p.header.stamp == published.header.stamp for p in r.poses), 5.0))
        same = next(p for p in r.poses if p.header.stamp == published.header.stamp)
        self.assertEqual(same.pose, published.pose)
        self.assertGreater(np.linalg.eigvalsh(np.reshape(published.pose.covariance, (6, 6)))[0], 0.0)
        self.assertTrue(r.wait_for(lambda: any(s.header.stamp == published.header.stamp and
                                               s.state == Status.TRACKING for s in r.statuses), 5.0), r.history())

    def test_global_localization_answers_when_the_clouds_stop(self):
        find = self.service('global_localization', GlobalLocalization)
        self.robot.send_clouds = False
        begin = time.monotonic()
        reply = find(False, True)  # on the last cloud; nothing comes that could confirm it
        self.assertFalse(reply.success, reply.message)
        self.assertIn('no scan on', reply.message)
        self.assertLess(time.monotonic() - begin, 20.0)
        begin = time.monotonic()
        reply = find(False, True)
        self.assertFalse(reply.success, reply.message)
        self.assertRegex(reply.message, "no scan on '/cloud' since [0-9.]+ s")
        self.assertLess(time.monotonic() - begin, 1.0)
        self.robot.send_clouds = True
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING), self.recorder.history())

    def test_global_localization_can_be_cancelled(self):
        find = self.service('global_localization', GlobalLocalization)
        self.assertFalse(find(True, False).success)  # nothing runs
        self.assertIsNotNone(self.recorder.wait_for_status(lambda s: s.state == Status.RELOCALIZING,
                                                           do=lambda: self.assertTrue(find(False, False).success)),
                             self.recorder.history())
        find(True, False)
        # Cancelled or already done: either way it recovers near the last pose by itself.
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING), self.recorder.history())

    def test_reset_forgets_the_pose_and_keeps_the_map(self):
        reset = self.service('reset', Trigger)
        self.assertTrue(reset().success)
        self.assertTrue(self.recorder.wait_for_state(Status.WAITING_FOR_POSE), self.recorder.history())
        self.assertNotEqual(self.recorder.statuses[-1].map_id, '')
        relocalize = self.service('relocalize', Relocalize)
        self.assertFalse(relocalize(True, pose_message(self.robot.T_map_base)).success)


if __name__ == '__main__':
    rospy.init_node('localization_test')
    rostest.rosrun('ttsdf_localization', 'localization', Localization)
