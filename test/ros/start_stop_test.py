#!/usr/bin/env python3
"""Stopped at any moment below a second after its start, node and nodelet end cleanly: no signal, no hang."""

import random
import signal
import subprocess
import tempfile
import time
import unittest

import roslib.packages
import rospy
import rostest

from fake_robot import FakeRobot

TIMES = 20
SECONDS_TO_STOP = 15.0


class StartStop(unittest.TestCase):
    def setUp(self):
        self.random = random.Random(1)
        self.log = tempfile.TemporaryFile('w+')
        self.addCleanup(self.log.close)
        # A robot that drives: callbacks and scans are on their way whenever the end comes.
        self.robot = FakeRobot().start()
        self.addCleanup(self.robot.stop)

    def start(self, package, program, *arguments):
        path = roslib.packages.find_node(package, program)[0]
        process = subprocess.Popen([path] + list(arguments), stdout=self.log, stderr=subprocess.STDOUT)
        self.addCleanup(self.kill, process)
        return process

    @staticmethod
    def kill(process):
        if process.poll() is None:
            process.kill()
            process.wait()

    def stop(self, process, which):
        process.send_signal(which)
        try:
            code = process.wait(SECONDS_TO_STOP)
        except subprocess.TimeoutExpired:
            code = 'still running after %.0f s' % SECONDS_TO_STOP
        if code not in (0, -which):  # the latter: before roscpp caught the signal
            self.log.seek(0)
            self.fail('%s: exit code %s\n%s' % (process.args, code, self.log.read()[-6000:]))

    def test_a_node_ends_at_any_moment(self):
        for n in range(TIMES):
            node = self.start('ttsdf_localization', 'localization_node', '__name:=stopped')
            time.sleep(self.random.uniform(0.1, 1.0))
            self.stop(node, signal.SIGINT if n % 2 else signal.SIGTERM)

    # Without a bond: while a bond waits for its first heartbeat, Debian's manager aborts with any nodelet (see
    # doc/troubleshooting.md).
    def test_a_manager_ends_at_any_moment(self):
        for _ in range(TIMES):
            manager = self.start('nodelet', 'nodelet', 'manager', '__name:=stopped_manager')
            loader = self.load('stopped_manager', '--no-bond')
            time.sleep(self.random.uniform(0.1, 1.0))
            self.stop(manager, signal.SIGINT)
            self.kill(loader)

    def test_a_nodelet_is_unloaded_and_loaded_again_at_any_moment(self):
        manager = self.start('nodelet', 'nodelet', 'manager', '__name:=lasting_manager')
        for _ in range(TIMES):
            loader = self.load('lasting_manager')
            # A loader that ends before its answer is there leaves the nodelet loaded until their bond breaks.
            rospy.wait_for_service('localization/reset', SECONDS_TO_STOP)
            time.sleep(self.random.uniform(0.1, 0.8))
            self.stop(loader, signal.SIGINT)  # unloads what it loaded
            self.assertIsNone(manager.poll(), 'the manager ended')
        time.sleep(2.0)  # the last bond is broken
        self.stop(manager, signal.SIGINT)

    def load(self, manager, *options):
        return self.start('nodelet', 'nodelet', 'load', 'ttsdf_localization/LocalizationNodelet', manager,
                          '__name:=localization', *options)


if __name__ == '__main__':
    rospy.init_node('start_stop_test')
    rostest.rosrun('ttsdf_localization', 'start_stop', StartStop)
