#!/usr/bin/env python3
"""Maps of an atlas come from a server; a slow, damaged or missing one does not stop a robot that drives."""

import unittest
import zlib

import rospy
import rostest
from geometry_msgs.msg import Point

from fake_robot import FakeRobot, Recorder, Status, pose_message
from ttsdf_localization.msg import AtlasInfo, AtlasMapFile, AtlasMapInfo
from ttsdf_localization.srv import GetDifferentialMap, GetSelectedMaps, GetSelectedMapsResponse

NAMES = ('room', 'room_rank_25')


class FakeServer:
    """Offers the two maps of the room, the second one from the moment the test wants it."""

    def __init__(self, folder):
        self.files = {name: open('%s/%s.ttsdf' % (folder, name), 'rb').read() for name in NAMES}
        self.answer = None    # takes the response and returns what is sent instead
        self.asked = 0
        self.publisher = rospy.Publisher('atlas', AtlasInfo, queue_size=1, latch=True)
        self.service = None
        self.start()

    def start(self):
        self.service = rospy.Service('get_selected_maps', GetSelectedMaps, self._get)

    def stop(self):
        self.service.shutdown('gone')

    def info(self, name):
        data = self.files[name]
        info = AtlasMapInfo(name=name, map_id='%08x' % zlib.crc32(data), bytes=len(data), version=1, voxel_size=0.05)
        for pose in (info.pose, info.box):
            pose.orientation.w = 1.0
        info.box.position.x = info.box.position.y = info.box.position.z = -0.3
        info.size.x, info.size.y, info.size.z = 6.6, 5.6, 3.6
        return info

    def publish(self, *names):
        message = AtlasInfo(maps=[self.info(name) for name in names])
        message.header.frame_id = 'map'
        self.publisher.publish(message)

    def _get(self, request):
        self.asked += 1
        response = GetSelectedMapsResponse(success=True)
        for map_id in request.map_ids:
            for name in NAMES:
                if self.info(name).map_id == map_id:
                    response.maps.append(AtlasMapFile(info=self.info(name), data=self.files[name]))
        return self.answer(response) if self.answer else response


class MapsFromAServer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.recorder = Recorder()
        cls.robot = FakeRobot().start()
        cls.server = FakeServer(rospy.get_param('~map_dir'))

    @classmethod
    def tearDownClass(cls):
        cls.robot.stop()

    def diagnosis(self):
        status = next((s for name, s in self.recorder.diagnostics.items() if name.endswith(': atlas')), None)
        return '' if status is None else ' '.join([status.message] + [v.key + ' ' + v.value for v in status.values])

    def wait_for_second_map(self):
        self.assertIsNotNone(self.recorder.wait_for_status(lambda s: s.pose_valid and '+' in s.map_id, timeout=40.0),
                             self.recorder.history() + self.diagnosis())

    def still_tracking(self):
        count = len(self.recorder.poses)
        self.assertTrue(self.recorder.wait_for(lambda: len(self.recorder.poses) > count + 5), self.recorder.history())
        self.assertEqual(self.recorder.state(), Status.TRACKING)

    def without_the_second_map(self, answer, said):
        """The second map is offered, and the server does not give it: the robot says so and goes on, then recovers."""
        self.server.publish('room')
        self.assertTrue(self.recorder.wait_for(lambda: '+' not in self.recorder.statuses[-1].map_id),
                        self.recorder.history())
        self.server.answer = answer
        self.server.publish(*NAMES)
        self.assertTrue(self.recorder.wait_for(lambda: said in self.diagnosis()), self.diagnosis())
        self.still_tracking()
        self.server.answer = None
        self.wait_for_second_map()

    def test_1_the_robot_is_tracked_in_the_server_s_maps(self):
        self.server.publish(*NAMES)
        self.assertTrue(self.robot.wait_for_subscriber(), 'nobody subscribes to the cloud')
        self.recorder.wait_for_initialpose_connection()
        self.recorder.set_pose(pose_message(self.robot.T_map_base))
        self.assertTrue(self.recorder.wait_for_state(Status.TRACKING), self.recorder.history() + self.diagnosis())
        self.robot.velocity = 0.2
        if '+' not in self.recorder.statuses[-1].map_id:
            self.wait_for_second_map()

    def test_2_damaged_maps_are_refused(self):
        def damage(response):
            for file in response.maps:
                middle = len(file.data) // 2
                file.data = file.data[:middle] + bytes([file.data[middle] ^ 1]) + file.data[middle + 1:]
            return response
        self.without_the_second_map(damage, 'failed: room_rank_25')

    def test_3_a_slow_server_is_asked_again(self):
        def sleep(response):
            rospy.sleep(3.0)
            return response
        self.without_the_second_map(sleep, 'no answer within')

    def test_4_a_server_that_is_gone_may_come_back(self):
        self.server.publish('room')
        self.assertTrue(self.recorder.wait_for(lambda: '+' not in self.recorder.statuses[-1].map_id))
        self.server.stop()
        self.server.publish(*NAMES)
        self.assertTrue(self.recorder.wait_for(lambda: 'is not there' in self.diagnosis()), self.diagnosis())
        self.still_tracking()
        self.server.start()
        self.wait_for_second_map()

    def test_5_the_server_of_this_package(self):
        infos = []
        subscriber = rospy.Subscriber('/real/atlas', AtlasInfo, infos.append)
        rospy.wait_for_service('/real/get_selected_maps', 30.0)
        selected = rospy.ServiceProxy('/real/get_selected_maps', GetSelectedMaps)
        difference = rospy.ServiceProxy('/real/get_differential_map', GetDifferentialMap)
        self.assertTrue(self.recorder.wait_for(lambda: infos), 'no atlas')
        subscriber.unregister()
        ids = {m.name: m.map_id for m in infos[0].maps}
        self.assertEqual(set(ids), {'hall', 'room'})

        answer = selected([ids['room'], ids['hall']])
        self.assertTrue(answer.success, answer.message)
        self.assertEqual([f.info.name for f in answer.maps], ['room', 'hall'])
        for file in answer.maps:
            self.assertEqual('%08x' % zlib.crc32(file.data), file.info.map_id)
        unknown = selected(['00000000'])
        self.assertFalse(unknown.success)
        self.assertIn('00000000', unknown.message)
        self.assertFalse(unknown.maps)

        # In the room, 30 m along x: the hall is not needed there.
        near = difference(Point(32.0, 2.0, 1.0), 3.0, [ids['hall'], 'deadbeef'])
        self.assertTrue(near.success, near.message)
        self.assertEqual([f.info.name for f in near.new_maps], ['room'])
        self.assertEqual(near.drop_ids, [ids['hall'], 'deadbeef'])
        nothing = difference(Point(32.0, 2.0, 1.0), 3.0, [ids['room']])
        self.assertTrue(nothing.success)
        self.assertFalse(nothing.new_maps)
        self.assertFalse(difference(Point(float('nan'), 0.0, 0.0), 3.0, []).success)


if __name__ == '__main__':
    rospy.init_node('atlas_server_test')
    rostest.rosrun('ttsdf_localization', 'atlas_server', MapsFromAServer)
