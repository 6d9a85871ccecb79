"""A robot with a depth camera in the analytic room, and a recorder of what the localizer says: shared by the tests."""

import os
import threading
import time
import unittest
import xmlrpc.client

import numpy as np
import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from tf2_msgs.msg import TFMessage

import room
from ttsdf_localization.msg import LocalizationStatus as Status

# How many times longer a node may take for its work: code with a sanitizer in it (scripts/test --sanitize) is slow.
SLOWER = 4.0 if os.environ.get('TTSDF_SANITIZED') else 1.0

START = room.pose(1.6, 1.2, 0.0, 0.5)
ELSEWHERE = room.pose(3.2, 3.6, 0.0, -1.2)


def process_of(node):
    """Process id of a node; rosgraph.MasterError if there is no such node."""
    uri = rosgraph.Master('/fake_robot').lookupNode(node)
    return xmlrpc.client.ServerProxy(uri).getPid('/fake_robot')[2]


def quaternion(R):
    """x y z w of a rotation matrix, by its largest component."""
    K = np.array([[R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                  [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                  [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                  [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]]]) / 3.0
    _, vectors = np.linalg.eigh(K)
    return vectors[:, -1]


def matrix(position, orientation):
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = [position.x, position.y, position.z]
    return T


def transform(parent, child, T, stamp):
    message = TransformStamped()
    message.header.stamp = stamp
    message.header.frame_id = parent
    message.child_frame_id = child
    t, q = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = T[:3, 3]
    q.x, q.y, q.z, q.w = quaternion(T[:3, :3])
    return message


def pose_message(T, frame='map', stamp=None, sigma=(0.1, 0.1, 0.1, 0.05, 0.05, 0.05)):
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    message.header.stamp = stamp or rospy.Time()
    p, q = message.pose.pose.position, message.pose.pose.orientation
    p.x, p.y, p.z = T[:3, 3]
    q.x, q.y, q.z, q.w = quaternion(T[:3, :3])
    message.pose.covariance = list(np.diag(np.square(sigma)).ravel())
    return message


def cloud_message(points, frame, stamp):
    """float32 x y z; an array of height x width x 3 gives an organised cloud."""
    points = np.asarray(points, dtype=np.float32)
    if points.ndim == 2:
        points = points[None]
    message = PointCloud2()
    message.header.frame_id = frame
    message.header.stamp = stamp
    message.height, message.width = points.shape[:2]
    message.fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate('xyz')]
    message.point_step = 12
    message.row_step = 12 * message.width
    message.data = points.tobytes()
    return message


def depth_messages(points, frame, stamp):
    """Depth image (32FC1) and camera_info of an organised scan of the room."""
    height, width = points.shape[:2]
    image = Image(height=height, width=width, encoding='32FC1', step=4 * width)
    image.header.frame_id, image.header.stamp = frame, stamp
    image.data = np.ascontiguousarray(points[:, :, 2], dtype=np.float32).tobytes()
    info = CameraInfo(header=image.header, height=height, width=width, distortion_model='plumb_bob', D=[0.0] * 5)
    f, cx, cy = room.FOCAL * width, 0.5 * (width - 1), 0.5 * (height - 1)
    info.K = [f, 0, cx, 0, f, cy, 0, 0, 1]
    info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0]
    return image, info


def errors(T, truth):
    """Distance [m] and angle [rad] between two poses."""
    D = np.linalg.inv(truth) @ T
    return np.linalg.norm(D[:3, 3]), np.arccos(np.clip((np.trace(D[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))


class StaticTransforms:
    """Latched for late listeners. One for all robots of a test: publishers of one topic share their latched message."""
    _publisher, _transforms = None, []

    @classmethod
    def send(cls, message):
        if cls._publisher is None:
            cls._publisher = rospy.Publisher('/tf_static', TFMessage, queue_size=5, latch=True)
        cls._transforms.append(message)
        cls._publisher.publish(cls._transforms)


class FakeRobot:
    """Publishes odometry TF and clouds at 10 Hz from a thread; what it does is changed by its fields."""

    def __init__(self, prefix='', cloud='cloud', odom='odom', start=START, rate=10.0, mount=True, depth_image=None,
                 camera_info=None, camera='camera'):
        """mount: publish where the camera sits; depth_image, camera_info: topics to publish on instead of clouds."""
        self.frames = {name: prefix + name for name in ('odom', 'base_link')}
        self.frames['camera'] = prefix + camera
        self.odom = odom
        self.T_map_base = start
        self.T_map_odom = room.pose(0.3, -0.2, 0.0, 0.1)
        self.velocity = 0.0           # [m/s] along x of the base, turned back at the ends of 0.6 m
        self.send_clouds = self.send_odometry = True
        self.period = 1.0 / rate
        self.odometry_delay = 0.0     # [s] between the stamp and the message
        self.cloud_every = 1          # steps per cloud
        self._late = []               # odometry on its way: when it is due, message
        self.truth = {}               # stamp -> T_map_base of every cloud sent
        self.change_points = None     # function of the points and a counter
        self._way = 0.0
        self._count = 0
        self._scans = {}
        self._lock = threading.RLock()
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=50)
        self._info = rospy.Publisher(camera_info, CameraInfo, queue_size=2) if depth_image else None
        self._clouds = rospy.Publisher(depth_image or cloud, Image if depth_image else PointCloud2, queue_size=2)
        if mount:
            StaticTransforms.send(transform(self.frames['base_link'], self.frames['camera'], room.T_BASE_CAMERA,
                                            rospy.Time.now()))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        self._thread.start()
        return self

    def stop(self):
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def kidnap(self, T_map_base):
        """Carried away: the odometry notices nothing."""
        with self._lock:
            T_odom_base = np.linalg.inv(self.T_map_odom) @ self.T_map_base
            self.T_map_base = T_map_base
            self._way = 0.0
            self.T_map_odom = T_map_base @ np.linalg.inv(T_odom_base)

    def step(self, stamp=None):
        with self._lock:
            stamp = stamp or rospy.Time.now()
            if self.velocity:
                self._way += self.velocity * self.period
                forward = np.eye(4)
                forward[0, 3] = self.velocity * self.period
                self.T_map_base = self.T_map_base @ forward
                if abs(self._way) > 0.6:
                    self.velocity = -self.velocity
            if self.send_odometry and self.odom:
                T_odom_base = np.linalg.inv(self.T_map_odom) @ self.T_map_base
                self._late.append((time.monotonic() + self.odometry_delay,
                                   [transform(self.odom, self.frames['base_link'], T_odom_base, stamp)]))
                self._send_due_odometry()
            if self.send_clouds and self._count % self.cloud_every == 0:
                self.truth[stamp.to_nsec()] = self.T_map_base.copy()
                self._publish_scan(stamp)
            self._count += 1

    def _publish_scan(self, stamp):
        if self._info is None:
            self._clouds.publish(cloud_message(self.points(), self.frames['camera'], stamp))
            return
        image, info = depth_messages(self.points(), self.frames['camera'], stamp)
        self._info.publish(info)
        self._clouds.publish(image)

    def points(self):
        key = tuple(np.round(self.T_map_base.ravel(), 9))
        if key not in self._scans:
            if len(self._scans) > 200:
                self._scans.clear()
            self._scans[key] = room.scan(self.T_map_base @ room.T_BASE_CAMERA)
        points = self._scans[key]
        return self.change_points(points.copy(), self._count) if self.change_points else points

    def publish_cloud(self, message):
        self._clouds.publish(message)

    def wait_for_subscriber(self, timeout=30.0):
        end = time.monotonic() + timeout
        while self._clouds.get_num_connections() == 0 and time.monotonic() < end:
            self._stop.wait(0.02)
        return self._clouds.get_num_connections() > 0

    def _send_due_odometry(self):
        while self._late and self._late[0][0] <= time.monotonic():
            self._tf.publish(self._late.pop(0)[1])

    def _run(self):
        # By wall time: simulated time may stand still.
        next_step = time.monotonic() + self.period
        while not rospy.is_shutdown():
            due = min([next_step] + [message[0] for message in self._late[:1]])
            if self._stop.wait(max(0.0, due - time.monotonic())):
                return
            with self._lock:
                self._send_due_odometry()
            if time.monotonic() >= next_step:
                self.step()
                next_step = max(next_step + self.period, time.monotonic())


class Recorder:
    """What one localizer publishes. Conditions are checked whenever something arrives; nothing sleeps."""

    def __init__(self, namespace='', child='odom', name='localization', parent='map'):
        self.poses, self.statuses, self.transforms, self.odometry, self.diagnostics = [], [], [], [], {}
        self.transform_arrivals = []
        self.private = (namespace + '/' if namespace else '') + name
        self.parent, self._child = parent, child
        self._changed = threading.Condition(threading.RLock())
        prefix = namespace + '/' if namespace else ''
        self._subscribers = [
            rospy.Subscriber(prefix + 'pose', PoseWithCovarianceStamped, self._keep(self.poses), queue_size=50),
            rospy.Subscriber(prefix + 'status', Status, self._keep(self.statuses), queue_size=200),
            rospy.Subscriber(prefix + 'odometry', Odometry, self._keep(self.odometry), queue_size=50),
            rospy.Subscriber('/tf', TFMessage, self._on_tf, queue_size=200),
            rospy.Subscriber('/diagnostics', DiagnosticArray, self._on_diagnostics, queue_size=50)]
        self._initialpose = rospy.Publisher(prefix + 'initialpose', PoseWithCovarianceStamped, queue_size=2)

    def _keep(self, where):
        def keep(message):
            with self._changed:
                where.append(message)
                self._changed.notify_all()
        return keep

    def _on_tf(self, message):
        with self._changed:
            for t in message.transforms:
                if t.header.frame_id == self.parent and t.child_frame_id == self._child:
                    self.transforms.append(t)
                    self.transform_arrivals.append(time.monotonic())
            self._changed.notify_all()

    def _on_diagnostics(self, message):
        with self._changed:
            for status in message.status:
                self.diagnostics[status.name] = status
            self._changed.notify_all()

    def wait_for(self, condition, timeout=60.0):
        """True as soon as condition() is true."""
        with self._changed:
            return bool(self._changed.wait_for(condition, timeout))

    def state(self):
        return self.statuses[-1].state if self.statuses else None

    def wait_for_state(self, *states, timeout=60.0):
        return self.wait_for(lambda: self.state() in states, timeout)

    def wait_for_new(self, what, n=1, timeout=60.0):
        """Waits for n more entries in one of the lists."""
        with self._changed:
            wanted = len(what) + n
            return bool(self._changed.wait_for(lambda: len(what) >= wanted, timeout))

    def wait_for_status(self, condition, timeout=60.0, do=None):
        """The first status from now on for which condition(status) is true, or None; `do` is called first."""
        with self._changed:
            begin = len(self.statuses)
            found = []

            def check():
                found[:] = [s for s in self.statuses[begin:] if condition(s)][:1]
                return bool(found)
            if do:
                do()
            self._changed.wait_for(check, timeout)
            return found[0] if found else None

    def wait_for_initialpose_connection(self, timeout=30.0):
        return self.wait_for(lambda: self._initialpose.get_num_connections() > 0, timeout) or \
            self._initialpose.get_num_connections() > 0

    def set_pose(self, message):
        self._initialpose.publish(message)

    def history(self):
        """For messages of failed tests."""
        return '; '.join('%s/%d %s' % (s.state_name, s.reason, s.message) for s in self.statuses[-5:])


def start_tracking(test, recorder, robot, timeout=90.0):
    """Gives the true pose and waits until the robot is tracked."""
    test.assertTrue(robot.wait_for_subscriber(), 'nobody subscribes to the cloud')
    test.assertTrue(recorder.wait_for(lambda: any(s.map_id for s in recorder.statuses), timeout), 'no map: ' +
                    recorder.history())
    recorder.wait_for_initialpose_connection()
    taken = recorder.wait_for_status(lambda s: 'initialpose taken' in s.message,
                                     do=lambda: recorder.set_pose(pose_message(robot.T_map_base, recorder.parent)))
    test.assertIsNotNone(taken, recorder.history())
    test.assertTrue(recorder.wait_for_state(Status.TRACKING, timeout=timeout), recorder.history())


class RobotTestCase(unittest.TestCase):
    """Tests that share one robot and one recorder, and begin with the robot being tracked."""

    robot_options = {}

    @classmethod
    def setUpClass(cls):
        cls.recorder = Recorder()
        cls.robot = FakeRobot(**cls.robot_options).start()

    @classmethod
    def tearDownClass(cls):
        cls.robot.stop()

    def setUp(self):
        self.robot.change_points = None
        self.robot.send_clouds = True
        self.robot.velocity = 0.0
        if self.recorder.state() != Status.TRACKING:
            start_tracking(self, self.recorder, self.robot)
