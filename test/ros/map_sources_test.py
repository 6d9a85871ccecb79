#!/usr/bin/env python3
"""The map comes from a topic or from a service that starts much later; nothing blocks meanwhile."""

import os
import signal
import subprocess
import threading
import time
import unittest

import roslib.packages
import rospy
import rostest

from fake_robot import FakeRobot, Recorder, Status, process_of, start_tracking
from ttsdf_localization.msg import TtSdfMap
from ttsdf_localization.srv import GetMap, GetMapResponse, LoadMap


def runs(process):
    try:
        with open('/proc/%d/stat' % process) as stat:
            return stat.read().rsplit(')', 1)[1].split()[0] != 'Z'
    except OSError:
        return False


class MapSources(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.maps = rospy.get_param('~map_dir')

    def message(self, name='room.ttsdf'):
        message = TtSdfMap()
        with open(os.path.join(self.maps, name), 'rb') as file:
            message.data = file.read()
        return message

    def test_from_a_topic(self):
        r = Recorder(namespace='topic', child='topic/odom')
        self.assertTrue(r.wait_for_state(Status.NO_MAP), 'it says what it waits for before the first scan')
        robot = FakeRobot(prefix='topic/', odom='topic/odom', cloud='topic/cloud').start()
        publisher = rospy.Publisher('topic/ttsdf_map', TtSdfMap, queue_size=1, latch=True)
        bad = self.message()
        bad.data = bad.data[:500]
        bad.map_id = 'the same'  # the whole one that follows is taken nevertheless
        publisher.publish(bad)
        self.assertTrue(r.wait_for(lambda: any(s.reason == Status.REASON_NO_MAP and 'wanted' in s.message
                                               for s in r.statuses)), r.history())
        good = self.message()
        good.map_id = 'the same'
        publisher.publish(good)
        self.assertTrue(r.wait_for(lambda: any('is in use; waiting for a pose: initialpose' in s.message
                                               for s in r.statuses)), r.history())
        start_tracking(self, r, robot)
        robot.stop()

    def test_from_a_service_that_comes_later(self):
        r = Recorder(namespace='service', child='service/odom')
        robot = FakeRobot(prefix='service/', odom='service/odom', cloud='service/cloud').start()
        self.assertTrue(r.wait_for_state(Status.NO_MAP), r.history())
        # It is alive although it has no map: its own services answer.
        rospy.wait_for_service('service/localization/load_map', 30.0)
        self.assertFalse(rospy.ServiceProxy('service/localization/load_map', LoadMap)('/no/file').success)
        # Whatever goes wrong: it is said, with the service's name, and the service is called again.
        cut = self.message()
        cut.data = cut.data[:500]
        answers = [lambda: GetMapResponse(False, 'not built yet', TtSdfMap()),
                   lambda: GetMapResponse(True, '', cut),
                   lambda: None,  # rospy answers such a call with an error
                   lambda: GetMapResponse(True, '', self.message())]
        calls = []

        def get_map(_):
            calls.append(1)
            return answers[min(len(calls), len(answers)) - 1]()
        rospy.Service('service/get_map', GetMap, get_map)
        start_tracking(self, r, robot)
        self.assertEqual(len(calls), len(answers))
        said = [s.message for s in r.statuses if "service '/service/get_map'" in s.message]
        self.assertEqual(len(said), 3, said)
        for message, words in zip(said, ('not built yet', 'sent a map that cannot be used', 'did not answer')):
            self.assertIn(words, message)
            self.assertNotIn('could not be called', message)
        robot.stop()

    def test_a_service_that_hangs_does_not_keep_the_localizer(self):
        called, release = threading.Event(), threading.Event()

        def get_map(_):
            called.set()
            release.wait(120.0)
            return GetMapResponse(False, 'late', TtSdfMap())
        rospy.Service('hangs/get_map', GetMap, get_map)
        self.assertTrue(called.wait(60.0))
        begin = time.monotonic()
        if rospy.get_param('~nodelet'):
            nodelet = roslib.packages.find_node('nodelet', 'nodelet')[0]
            done = subprocess.run([nodelet, 'unload', '/hangs/localization', '/hangs/localization_manager'],
                                  timeout=60.0, check=False)
            self.assertEqual(done.returncode, 0)
        else:
            process = process_of('/hangs/localization')
            os.kill(process, signal.SIGINT)  # as roslaunch does
            while runs(process) and time.monotonic() - begin < 10.0:
                time.sleep(0.05)
        self.assertLess(time.monotonic() - begin, 10.0)
        release.set()


if __name__ == '__main__':
    rospy.init_node('map_sources_test')
    rostest.rosrun('ttsdf_localization', 'map_sources', MapSources)
