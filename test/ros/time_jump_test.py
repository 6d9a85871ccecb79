#!/usr/bin/env python3
"""A bag that loops: the clock goes back, the map stays, and localization goes on. One played fast: TF keeps up."""

import threading
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Clock

from fake_robot import START, FakeRobot, Recorder, Status, errors, matrix, start_tracking


class TimeJump(unittest.TestCase):
    def test_localization_goes_on_after_every_loop(self):
        recorder = Recorder()
        robot = FakeRobot()
        clock = rospy.Publisher('/clock', Clock, queue_size=10)
        now = [1000.0]
        speed = 1.0
        stop = threading.Event()

        def play():
            ticks = 0
            while not stop.wait(0.02 / speed):
                ticks += 1
                now[0] += 0.02
                clock.publish(Clock(rospy.Time.from_sec(now[0])))
                if ticks % 5 == 0:
                    robot.step(rospy.Time.from_sec(now[0]))
        player = threading.Thread(target=play, daemon=True)
        player.start()
        robot.velocity = 0.2
        start_tracking(self, recorder, robot)
        map_id = recorder.statuses[-1].map_id

        for _ in range(3):
            self.assertTrue(recorder.wait_for_new(recorder.poses, 10), recorder.history())
            begin = len(recorder.transforms)

            def loop():
                """The bag starts again, where and when it started the first time."""
                robot.kidnap(START)
                robot.truth.clear()
                now[0] = 1000.0
            status = recorder.wait_for_status(lambda s: s.reason == Status.REASON_TIME_JUMP, do=loop)
            self.assertIsNotNone(status, recorder.history())
            status = recorder.wait_for_status(lambda s: s.pose_valid)
            self.assertIsNotNone(status, recorder.history())
            self.assertEqual(status.map_id, map_id)
            self.assertTrue(recorder.wait_for_new(recorder.poses, 3))
            pose = recorder.poses[-1]
            translation, _ = errors(matrix(pose.pose.pose.position, pose.pose.pose.orientation),
                                    robot.truth[pose.header.stamp.to_nsec()])
            self.assertLess(translation, 0.02)
            # One step back, and from there the stamps of the transform rise again.
            self.assertTrue(recorder.wait_for_new(recorder.transforms, 5))
            stamps = [t.header.stamp for t in recorder.transforms[begin:]]
            self.assertLessEqual(sum(later <= earlier for earlier, later in zip(stamps, stamps[1:])), 1)
            self.assertLess(stamps[-1].to_sec(), now[0] + 1.0)

        speed = 4.0
        self.assertTrue(recorder.wait_for_new(recorder.poses, 20), recorder.history())
        robot.send_clouds = False
        begin = len(recorder.transforms)
        self.assertTrue(recorder.wait_for_new(recorder.transforms, 20), recorder.history())
        stamps = [t.header.stamp for t in recorder.transforms[begin:]]
        self.assertGreater((len(stamps) - 1) / (stamps[-1] - stamps[0]).to_sec(), 15.0)
        stop.set()
        player.join()


if __name__ == '__main__':
    rospy.init_node('time_jump_test')
    rostest.rosrun('ttsdf_localization', 'time_jump', TimeJump)
