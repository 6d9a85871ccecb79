#!/usr/bin/env python3
"""The surface of the map in use: nothing before there is a map, then the analytic room's, in the localizer's frame."""

import threading
import unittest

import numpy as np
import rospy
import rostest
from visualization_msgs.msg import Marker

import room
from ttsdf_localization.srv import GetMap, LoadMap


class MapSurface(unittest.TestCase):
    def setUp(self):
        self.changed = threading.Condition()
        self.markers = []
        rospy.Subscriber('map_surface', Marker, self.on_marker)

    def on_marker(self, marker):
        with self.changed:
            self.markers.append(marker)
            self.changed.notify_all()

    def test_it_is_that_of_the_map_in_use(self):
        rospy.wait_for_service('localization/get_map', 30.0)
        get_map = rospy.ServiceProxy('localization/get_map', GetMap)
        answer = get_map()
        self.assertFalse(answer.success)
        self.assertIn('no map', answer.message)

        path = rospy.get_param('map_dir') + '/room.ttsdf'
        loaded = rospy.ServiceProxy('localization/load_map', LoadMap)(filename=path)
        self.assertTrue(loaded.success, loaded.message)
        with self.changed:
            self.assertTrue(self.changed.wait_for(lambda: self.markers, 60.0))
        marker = self.markers[-1]
        self.assertEqual(marker.type, Marker.TRIANGLE_LIST)
        self.assertEqual(marker.header.frame_id, 'map')
        points = np.array([(p.x, p.y, p.z) for p in marker.points])
        self.assertGreater(len(points), 3000)
        self.assertLess(np.sqrt(np.mean(room.distance(points) ** 2)), 0.02)  # the map's voxels are 5 cm

        answer = get_map()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.map.map_id, loaded.map_id)
        with open(path, 'rb') as file:
            self.assertEqual(answer.map.data, file.read())


if __name__ == '__main__':
    rospy.init_node('map_surface_test')
    rostest.rosrun('ttsdf_localization', 'map_surface', MapSurface)
