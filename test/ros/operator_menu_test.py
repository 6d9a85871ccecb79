#!/usr/bin/env python3
"""The operator's menu: a map is loaded and the robot found by clicks, as rviz sends them; the text says what happens."""

import threading
import unittest

import rospy
import rostest
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerInit, InteractiveMarkerUpdate, Marker

from fake_robot import FakeRobot, Recorder, errors, matrix


class OperatorMenu(unittest.TestCase):
    def setUp(self):
        self.changed = threading.Condition()
        self.entries, self.texts = {}, []
        rospy.Subscriber('operator/update_full', InteractiveMarkerInit, lambda m: self.on_markers(m.markers))
        rospy.Subscriber('operator/update', InteractiveMarkerUpdate, lambda m: self.on_markers(m.markers))
        rospy.Subscriber('operator/text', Marker, self.on_text, queue_size=100)
        self.feedback = rospy.Publisher('operator/feedback', InteractiveMarkerFeedback, queue_size=5)
        self.recorder = Recorder()
        self.robot = FakeRobot().start()
        self.assertTrue(self.robot.wait_for_subscriber())

    def tearDown(self):
        self.robot.stop()

    def on_markers(self, markers):
        with self.changed:
            for marker in markers:
                self.entries = {entry.title: entry.id for entry in marker.menu_entries}
            self.changed.notify_all()

    def on_text(self, marker):
        with self.changed:
            self.texts.append(marker.text)
            self.changed.notify_all()

    def click(self, title):
        with self.changed:
            self.assertTrue(self.changed.wait_for(
                lambda: title in self.entries and self.feedback.get_num_connections() > 0, 60.0), self.entries)
            message = InteractiveMarkerFeedback(client_id='test', marker_name='operator', control_name='menu',
                                                event_type=InteractiveMarkerFeedback.MENU_SELECT,
                                                menu_entry_id=self.entries[title])
            begin = len(self.texts)
        message.header.frame_id = 'map'
        self.feedback.publish(message)
        return begin

    def wait_for_text(self, begin, *words):
        with self.changed:
            found = self.changed.wait_for(
                lambda: any(all(word in text for word in words) for text in self.texts[begin:]), 90.0)
        self.assertTrue(found, (words, self.texts[-3:]))

    def test_from_nothing_to_tracking_by_clicks(self):
        self.wait_for_text(0, 'no_map')
        begin = self.click('Build a map and save it')  # nobody builds here
        self.wait_for_text(begin, 'map_builder/build_map', 'no such service')
        begin = self.click('room.ttsdf')
        self.wait_for_text(begin, 'waiting_for_pose', 'load_map: map ')
        begin = self.click('Search near the last pose')
        self.wait_for_text(begin, 'relocalize refused', 'no last pose')
        begin = self.click('Global localization')
        self.wait_for_text(begin, 'tracking', 'inliers')
        r = self.recorder
        self.assertTrue(r.wait_for_new(r.poses, 3), r.history())
        pose = r.poses[-1].pose.pose
        self.assertLess(errors(matrix(pose.position, pose.orientation), self.robot.T_map_base)[0], 0.03)
        begin = self.click('Pause')
        self.wait_for_text(begin, 'paused')
        begin = self.click('Go on')
        self.wait_for_text(begin, 'tracking')
        begin = self.click('Forget the pose')
        self.wait_for_text(begin, 'waiting_for_pose', 'reset')


if __name__ == '__main__':
    rospy.init_node('operator_menu_test')
    rostest.rosrun('ttsdf_localization', 'operator_menu', OperatorMenu)
