#!/usr/bin/env python3
"""Faults as reality makes them: late odometry, slow and dead cameras, resets while a scan is in work. State, transform and
diagnostics never contradict each other."""

import threading
import time

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from std_srvs.srv import Empty, SetBool, Trigger

import room
from fake_robot import SLOWER, RobotTestCase, Status, errors, matrix, start_tracking
from ttsdf_localization.srv import LoadMap, Relocalize

IN_USE = (Status.TRACKING, Status.DEGRADED, Status.PAUSED)
SLACK = 1.0 * SLOWER  # [s] that the three may lag behind one another


class Faults(RobotTestCase):
    robot_options = {'rate': 20.0}

    def setUp(self):
        self.robot.cloud_every = 2
        self.robot.odometry_delay = 0.0
        self.robot.send_odometry = True
        super().setUp()
        self.contradictions = []
        self._stop = threading.Event()
        self._sampler = threading.Thread(target=self._sample, daemon=True)
        self._sampler.start()

    def tearDown(self):
        self._stop.set()
        self._sampler.join()
        self.assertEqual(self.contradictions, [])

    def _sample(self):
        """What contradicts the state for longer than the slack."""
        since = {}
        while not self._stop.wait(0.05):
            r, now = self.recorder, time.monotonic()
            state, name = r.statuses[-1].state, r.statuses[-1].state_name
            sent = bool(r.transform_arrivals) and now - r.transform_arrivals[-1] < 0.3
            diagnostics = {key.split(': ')[-1]: value for key, value in r.diagnostics.items()}
            found = set()
            if sent and state not in IN_USE:
                found.add('TF is sent in state ' + name)
            if 'localization' in diagnostics and not diagnostics['localization'].message.startswith(name):
                found.add('state %s, diagnostics %s' % (name, diagnostics['localization'].message[:20]))
            if 'transforms' in diagnostics and ('is sent' in diagnostics['transforms'].message) != sent and \
                    'wait' not in diagnostics['transforms'].message:
                found.add('TF %s, diagnostics: %s' % (sent, diagnostics['transforms'].message))
            since = {what: since.get(what, now) for what in found}
            for what, begin in since.items():
                if now - begin > SLACK and what not in self.contradictions:
                    self.contradictions.append(what)

    def assert_poses_are_right(self, begin, limit=0.05):
        poses = self.recorder.poses[begin:]
        for pose in poses:
            truth = self.robot.truth[pose.header.stamp.to_nsec()]
            self.assertLess(errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation), truth)[0], limit)
        return len(poses)

    def test_late_odometry_of_slow_clouds_is_waited_for(self):
        r = self.recorder
        self.robot.cloud_every = 20  # a cloud per second
        self.robot.odometry_delay = 0.08
        self.robot.velocity = 0.1
        self.assertTrue(r.wait_for_new(r.poses, 4, 20.0), r.history())  # until the new rate is the usual one
        begin, statuses, transforms = len(r.poses), len(r.statuses), len(r.transforms)
        self.assertTrue(r.wait_for_new(r.poses, 5, 20.0), r.history())
        self.assertFalse([s.message for s in r.statuses[statuses:] if 'odometry' in s.message])
        self.assertTrue(all(s.state == Status.TRACKING for s in r.statuses[statuses:]), r.history())
        self.assertGreater(len(r.transforms) - transforms, 60)
        self.assertGreaterEqual(self.assert_poses_are_right(begin), 5)

    def test_after_a_pause_of_the_camera_a_good_scan_is_no_jump(self):
        r = self.recorder
        self.robot.send_clouds = False
        self.robot.velocity = 0.3
        self.robot._way = -1.0  # straight on for long
        time.sleep(3.0)
        begin, statuses = len(r.poses), len(r.statuses)
        self.robot.send_clouds = True
        self.assertTrue(r.wait_for_new(r.poses, 3, 20.0), r.history())
        self.assertFalse([s.message for s in r.statuses[statuses:] if s.reason == Status.REASON_JUMP])
        self.assert_poses_are_right(begin)

    def test_a_dead_camera_is_degraded_then_lost_and_found_again(self):
        r = self.recorder
        died = time.monotonic()
        degraded = r.wait_for_status(lambda s: s.state == Status.DEGRADED, 10.0,
                                     do=lambda: setattr(self.robot, 'send_clouds', False))
        self.assertIsNotNone(degraded, r.history())
        self.assertLess(time.monotonic() - died, 2.0)
        self.assertEqual(degraded.reason, Status.REASON_NO_SCAN)
        self.assertFalse(degraded.header.stamp.is_zero())
        self.assertIsNotNone(r.wait_for_status(lambda s: s.state == Status.LOST, 15.0), r.history())
        self.assertLess(time.monotonic() - died, 8.0)
        time.sleep(0.5)
        transforms = len(r.transforms)
        time.sleep(1.0)
        self.assertEqual(len(r.transforms), transforms)
        begin = len(r.poses)
        self.robot.send_clouds = True
        self.assertTrue(r.wait_for_state(Status.TRACKING, timeout=30.0), r.history())
        self.assertTrue(r.wait_for_new(r.poses, 3))
        self.assert_poses_are_right(begin)

    def test_after_a_reset_nothing_old_is_on_the_air(self):
        r = self.recorder
        reset = rospy.ServiceProxy(r.private + '/reset', Trigger)
        self.robot.cloud_every = 1
        for _ in range(8):
            self.assertTrue(reset().success)
            time.sleep(0.15)  # what was on its way
            transforms = len(r.transforms)
            time.sleep(0.4)
            self.assertEqual(len(r.transforms), transforms)
            self.assertEqual(r.state(), Status.WAITING_FOR_POSE)
            start_tracking(self, r, self.robot)

    def test_relocalize_takes_no_old_scan(self):
        r = self.recorder
        self.robot.send_clouds = False
        time.sleep(3.6)
        relocalize = rospy.ServiceProxy(r.private + '/relocalize', Relocalize)
        state = r.state()
        reply = relocalize(use_last_pose=True)
        self.assertFalse(reply.success)
        self.assertIn('no scan', reply.message)
        self.assertEqual(r.state(), state)

    def test_the_last_map_asked_for_is_in_use(self):
        folder = rospy.get_param('/localization/map_file').rsplit('/', 1)[0]
        load = rospy.ServiceProxy(self.recorder.private + '/load_map', LoadMap)
        other = load(folder + '/room_rank_25.ttsdf').map_id
        for _ in range(3):
            other_load = rospy.ServiceProxy(self.recorder.private + '/load_map', LoadMap)  # a proxy is for one thread
            first = threading.Thread(target=other_load, args=(folder + '/room.ttsdf',))
            first.start()
            time.sleep(0.06)  # so that it arrives first
            self.assertTrue(load(folder + '/room_rank_25.ttsdf').success)
            first.join()
            self.assertTrue(self.recorder.wait_for(lambda: self.recorder.statuses[-1].map_id == other), 'another map')
        self.assertTrue(load(folder + '/room.ttsdf').success)

    def test_a_robot_that_stands_still_needs_no_scans(self):
        r = self.recorder
        service = rospy.ServiceProxy(r.private + '/set_parameters', Reconfigure)
        service(Config(doubles=[DoubleParameter('update_min_d', 0.1), DoubleParameter('update_min_a', 0.1)]))
        try:
            time.sleep(0.5)
            poses = len(r.poses)
            time.sleep(2.0)
            self.assertLessEqual(len(r.poses) - poses, 1)
            self.assertEqual(r.state(), Status.TRACKING)
            self.assertLess(time.monotonic() - r.transform_arrivals[-1], 0.5)
            poses = len(r.poses)
            rospy.ServiceProxy(r.private + '/request_nomotion_update', Empty)()
            self.assertTrue(r.wait_for(lambda: len(r.poses) == poses + 1, 5.0))
            self.robot.velocity = 0.3
            self.assertTrue(r.wait_for_new(r.poses, 3, 10.0))
        finally:
            service(Config(doubles=[DoubleParameter('update_min_d', 0.0), DoubleParameter('update_min_a', 0.0)]))

    def test_a_storm_of_nan_and_lying_flags_gives_no_wrong_pose(self):
        r = self.recorder
        begin, n = len(r.poses), [0]
        random = np.random.RandomState(1)

        def storm(points, _):
            n[0] += 1
            if n[0] % 3 == 0:
                return points
            points[random.rand(*points.shape[:2]) < (0.5 if n[0] % 3 == 1 else 1.0)] = np.nan
            return points
        self.robot.change_points = storm
        self.robot.velocity = 0.1
        self.assertTrue(r.wait_for_new(r.poses, 10, 30.0), r.history())
        self.assert_poses_are_right(begin)

    def test_odometry_that_dies_stops_no_poses(self):
        r = self.recorder
        self.robot.velocity = 0.1
        self.robot.send_odometry = False
        status = r.wait_for_status(lambda s: s.pose_valid and 'odometry is missing' in s.message, 10.0)
        self.assertIsNotNone(status, r.history())
        begin = len(r.poses)
        self.assertTrue(r.wait_for_new(r.poses, 10, 20.0))
        self.assert_poses_are_right(begin)
        self.robot.send_odometry = True
        self.assertIsNotNone(r.wait_for_status(lambda s: s.pose_valid and 'odometry' not in s.message, 10.0))

    def test_paused_is_paused(self):
        r = self.recorder
        pause = rospy.ServiceProxy(r.private + '/pause', SetBool)
        pause(True)
        try:
            self.assertTrue(r.wait_for_state(Status.PAUSED, timeout=5.0))
            time.sleep(1.5)
            poses = len(r.poses)
            time.sleep(0.5)
            self.assertEqual(len(r.poses), poses)
        finally:
            pause(False)
        self.assertTrue(r.wait_for_state(Status.TRACKING, timeout=20.0), r.history())


if __name__ == '__main__':
    rospy.init_node('faults_test')
    rostest.rosrun('ttsdf_localization', 'faults', Faults)
