"""Bags that drivers and damage make: each is localized rightly, or the message names the topic, what was got and wanted.
usage: odd_bags_test.py OFFLINE-LOCALIZER MAP-OF-THE-ROOM"""

import csv
import io
import os
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import PIL.Image
import rosbag
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu, PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import room  # noqa: E402

TOOL, MAP = sys.argv[1:3]
WIDTH, HEIGHT, COUNT = 64, 48, 12
FOCAL = room.FOCAL * WIDTH
NAN = float("nan")
REASON_OLD_STAMP = 18  # of LocalizationStatus, which this test does without


def base_pose(n):
    return room.pose(1.6 + 0.02 * n, 1.2 + 0.015 * n, 0, 0.5 + 0.02 * n)


SCANS = [room.scan(base_pose(n) @ room.T_BASE_CAMERA, WIDTH, HEIGHT) for n in range(COUNT)]
DEPTHS = [scan[:, :, 2] for scan in SCANS]


def quaternion(R):
    """x y z w, by the largest eigenvalue: right for every rotation."""
    K = np.array([[R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                  [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                  [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                  [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R.trace()]])
    values, vectors = np.linalg.eigh(K)
    return vectors[:, np.argmax(values)]


def set_rotation(message, q):
    message.x, message.y, message.z, message.w = q


def transform(T, parent, child, stamp):
    message = TransformStamped()
    message.header.frame_id, message.header.stamp, message.child_frame_id = parent, stamp, child
    t = message.transform.translation
    t.x, t.y, t.z = T[:3, 3]
    set_rotation(message.transform.rotation, quaternion(T[:3, :3]))
    return message


def png(pixels):
    out = io.BytesIO()
    PIL.Image.fromarray(pixels).save(out, "png")
    return out.getvalue()


def millimetres(n):
    return np.round(1000 * DEPTHS[n]).astype("<u2")


def cloud(n):
    message = PointCloud2()
    message.height, message.width, message.point_step, message.row_step = HEIGHT, WIDTH, 12, 12 * WIDTH
    message.fields = [PointField(axis, 4 * i, PointField.FLOAT32, 1) for i, axis in enumerate("xyz")]
    message.data = SCANS[n].astype("<f4").tobytes()
    return message


def image(n, encoding):
    message = Image()
    message.width, message.height, message.encoding = WIDTH, HEIGHT, encoding
    pixels = DEPTHS[n].astype("<f4") if encoding == "32FC1" else millimetres(n)
    message.data, message.step = pixels.tobytes(), pixels.itemsize * WIDTH
    return message


def compressed(n):
    message = CompressedImage()
    message.format = "16UC1; compressedDepth"
    message.data = struct.pack("<iff", 0, 0, 0) + png(millimetres(n))
    return message


def camera_info():
    message = CameraInfo()
    message.width, message.height, message.distortion_model, message.D = WIDTH, HEIGHT, "plumb_bob", [0.0] * 5
    message.K = [FOCAL, 0, (WIDTH - 1) / 2, 0, FOCAL, (HEIGHT - 1) / 2, 0, 0, 1]
    message.P = [FOCAL, 0, (WIDTH - 1) / 2, 0, 0, FOCAL, (HEIGHT - 1) / 2, 0, 0, 0, 1, 0]
    message.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    return message


def same(message):
    pass


def fields(**values):
    def edit(message):
        for name, value in values.items():
            setattr(message, name, value)
    return edit


def point_fields(**values):
    def edit(message):
        for field in message.fields:
            for name, value in values.items():
                setattr(field, name, value)
    return edit


def projection(fx, fy, cx, cy):
    return fields(K=[fx, 0, cx, 0, fy, cy, 0, 0, 1], P=[fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])


def pixels(kind, change):
    def edit(message):
        message.data = change(np.frombuffer(message.data, kind)).tobytes()
    return edit


def both(*edits):
    def edit(message):
        for one in edits:
            one(message)
    return edit


class OddBags(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def write(self, kind="cloud", edit=same, edit_tf=lambda parent, tf: None, edit_info=same, edit_pose=same, stamp_of=None,
              recorded=None, scans=True, other=lambda bag: None):
        with rosbag.Bag(self.path("run.bag"), "w") as bag:
            start = rospy.Time(1000)
            mount = TFMessage([transform(room.T_BASE_CAMERA, "base_link", "camera", start)])
            edit_tf("base_link", mount)
            bag.write("/tf_static", mount, start)
            for n in range(COUNT):
                stamp = rospy.Time.from_sec(1000 + 0.1 * n)
                written = rospy.Time.from_sec(1000 + 0.1 * (recorded[n] if recorded else n))
                if n == 0:
                    pose = PoseWithCovarianceStamped()
                    pose.header.frame_id, pose.header.stamp = "map", stamp
                    pose.pose.pose.position.x, pose.pose.pose.position.y = base_pose(0)[:2, 3]
                    set_rotation(pose.pose.pose.orientation, quaternion(base_pose(0)[:3, :3]))
                    pose.pose.covariance = np.diag([0.01] * 6).ravel().tolist()
                    edit_pose(pose)
                    bag.write("/initialpose", pose, written)
                odometry = TFMessage([transform(base_pose(n), "odom", "base_link", stamp)])
                edit_tf("odom", odometry)
                bag.write("/tf", odometry, written)
                if not scans:
                    continue
                message = cloud(n) if kind == "cloud" else compressed(n) if kind == "compressed" else image(n, kind)
                message.header.frame_id = "camera"
                message.header.stamp = stamp_of(n) if stamp_of else stamp
                edit(message)
                topic = {"cloud": "/camera/points", "compressed": "/camera/depth/image/compressedDepth"}.get(
                    kind, "/camera/depth/image")
                if kind != "cloud":
                    info = camera_info()
                    info.header = message.header
                    edit_info(info)
                    bag.write("/camera/depth/camera_info", info, written)
                bag.write(topic, message, written)
            other(bag)

    def run_tool(self, *arguments):
        for name in ("poses.tum", "statuses.csv"):
            if os.path.exists(self.path(name)):
                os.remove(self.path(name))
        done = subprocess.run([TOOL, self.path("run.bag"), "--map", MAP, "--trajectory", self.path("poses.tum"), "--statuses",
                               self.path("statuses.csv"), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120)
        return done.returncode, done.stderr.decode(errors="replace")

    def expect_right(self, name, least=8, words=(), arguments=(), **changes):
        self.write(**changes)
        code, said = self.run_tool(*arguments)
        self.assertEqual(code, 0, name + ": " + said)
        for word in words:
            self.assertIn(word, said, name)
        with open(self.path("poses.tum")) as lines:
            rows = [[float(word) for word in line.split()] for line in lines]
        self.assertGreaterEqual(len(rows), least, name)
        for row in rows:
            truth = base_pose((row[0] - 1000) / 0.1)[:2, 3]
            self.assertLess(np.linalg.norm(np.array(row[1:3]) - truth), 0.02, name)

    def expect_named(self, name, words, code=3, **changes):
        self.write(**changes)
        got, said = self.run_tool()
        self.assertEqual(got, code, name + ": " + said)
        for word in words:
            self.assertIn(word, said, name)
        self.assertNotIn("\x1b", said, name)

    def test_clouds_that_are_odd_but_clear(self):
        swapped = pixels("<f4", lambda v: v.astype(">f4"))
        for name, edit in {"as it is": same, "count 3": lambda m: setattr(m.fields[0], "count", 3),
                           "count 0": point_fields(count=0), "count huge": point_fields(count=4294967295),
                           "twice the same field": lambda m: m.fields.append(m.fields[0]),
                           "big-endian": both(swapped, fields(is_bigendian=True))}.items():
            self.expect_right(name, edit=edit)
        self.expect_right("flag of the byte order lies", edit=fields(is_bigendian=True), words=["is_bigendian of 12 clouds is wrong"])

    def test_clouds_that_cannot_be_read_are_named(self):
        topic = "topic 'camera/points': cloud: "
        for name, words, edit in (
                ("offset huge", "field 'y' ends at byte", lambda m: setattr(m.fields[1], "offset", 4294967292)),
                ("one place for all", "fields 'x' and 'y' overlap", point_fields(offset=0)),
                ("overlap", "fields 'x' and 'y' overlap", lambda m: [setattr(f, "offset", 2 * n) for n, f in enumerate(m.fields)]),
                ("two fields x", "two fields 'x'", lambda m: m.fields.insert(0, PointField("x", 8, 7, 1))),
                ("no fields", "no field 'x'", fields(fields=[])),
                ("integers", "datatype 5", point_fields(datatype=5)),
                ("unknown type", "datatype 99", point_fields(datatype=99)),
                ("point_step 0", "of a point of 0 bytes", fields(point_step=0)),
                ("point_step huge", "row_step", fields(point_step=4294967295)),
                ("point_step of other data", "row_step", fields(point_step=13)),
                ("row_step huge", "bytes of data, wanted", fields(row_step=4294967295)),
                ("row_step short", "row_step 5 is less", fields(row_step=5)),
                ("product of 2^32", "row_step", fields(width=65536, height=65536)),
                ("product of 2^64", "row_step", fields(width=4294967295, height=4294967295)),
                ("product beyond 64 bits", "row_step", fields(width=2**31, height=2, point_step=2**31, row_step=0)),
                ("no data", "got 0 bytes of data", fields(data=b""))):
            self.expect_named(name, ["12 of 12 scans: " + topic, words], edit=edit)

    def test_scans_without_points_are_named(self):
        words = ["12 scans have no point between 0.2 and 6 m"]
        self.expect_named("width 0", words, edit=fields(width=0))
        self.expect_named("nothing", words, edit=fields(width=0, height=0, data=b""))
        self.expect_named("all NaN", words + ["no reading at all"], edit=pixels("<f4", lambda v: v * np.float32(NAN)))
        self.expect_named("millimetres", words, edit=pixels("<f4", lambda v: v * np.float32(1000)))
        self.expect_named("image of width 0", words, kind="16UC1", edit=fields(width=0))

    def test_stamps_and_frames(self):
        self.expect_named("no frame", ["no frame_id"], edit=lambda m: setattr(m.header, "frame_id", ""))
        self.expect_named("control characters", ["'x?[31m'"], edit=lambda m: setattr(m.header, "frame_id", "x\x1b[31m"))
        self.expect_named("stamps of 0", ["stamp 0"], stamp_of=lambda n: rospy.Time(0))
        self.expect_named("one stamp", ["not newer"], stamp_of=lambda n: rospy.Time(1000))
        with open(self.path("statuses.csv"), newline="") as lines:
            reasons = [int(row["reason"]) for row in csv.DictReader(lines)]
        self.assertEqual(reasons[1:], [REASON_OLD_STAMP] * (COUNT - 1))
        self.expect_named("end of time", ["stamp 4294967295.999999999", "the bag's time"],
                          stamp_of=lambda n: rospy.Time(4294967295, 999999999))
        self.expect_named("long ago", ["older than the transforms"], stamp_of=lambda n: rospy.Time(5))
        self.expect_named("reversed", ["not newer"], recorded=list(range(COUNT))[::-1])
        self.expect_right("out of order", least=3, recorded=[0, 5, 1, 3, 2, 4, 11, 7, 9, 8, 6, 10])

    def test_stamps_at_the_end_of_time(self):
        end = rospy.Time(4294967295)

        def one_transform(of, tf):
            if of == "odom" and tf.transforms[0].header.stamp == rospy.Time.from_sec(1000.3):
                far = transform(np.eye(4), "odom", "base_link", end)
                tf.transforms.insert(0, far)
        self.expect_right("a transform", edit_tf=one_transform, words=[
            "left out: 1 transforms of tf", "'odom' -> 'base_link'", "stamp 4294967295", "the bag's time"])

        def all_of_a_frame(of, tf):
            if of == "odom":
                tf.transforms.append(transform(np.eye(4), "odom", "other", end))
        self.expect_right("a frame", edit_tf=all_of_a_frame, words=["left out: 12 transforms", "'odom' -> 'other'"])

        def imu(bag):
            for n in range(3):
                message = Imu()
                message.header.frame_id, message.linear_acceleration.z = "camera", 9.81
                message.header.stamp = end if n == 1 else rospy.Time(1000 + n)
                bag.write("/imu", message, rospy.Time.from_sec(1000.5 + 0.1 * n))
        self.expect_right("an IMU", other=imu, arguments=["--imu", "imu", "--set", "gravity_source=imu"],
                          words=["left out: 1 messages of the IMU", "stamp 4294967295"])

        def late_pose(pose):
            pose.header.stamp = end
        self.expect_right("a start pose", edit_pose=late_pose, words=["taken for now"])

    def test_bags_without_scans(self):
        self.expect_named("transforms only", ["wanted one topic of clouds", "tf (tf2_msgs/TFMessage)"], code=1, scans=False)
        with rosbag.Bag(self.path("run.bag"), "w"):
            pass
        code, said = self.run_tool()
        self.assertEqual(code, 1)
        self.assertIn("got no topics", said)
        self.expect_named("another type on the topic", ["/camera/points", "sensor_msgs/PointCloud2"], code=1,
                          other=lambda bag: bag.write("/camera/points", String("x"), rospy.Time(1002)))

    def test_transforms(self):
        def more(parent, child):
            def edit(of, tf):
                if of == "odom":
                    tf.transforms.append(transform(np.eye(4), parent, child, tf.transforms[0].header.stamp))
            return edit
        self.expect_right("loop", edit_tf=more("camera", "odom"))
        self.expect_right("its own parent", edit_tf=more("odom", "odom"))

        def rotation(which, factor):
            def edit(of, tf):
                if of == which:
                    q = tf.transforms[0].transform.rotation
                    set_rotation(q, [factor * v for v in (q.x, q.y, q.z, q.w)])
            return edit

        def position(which, value):
            def edit(of, tf):
                if of == which:
                    tf.transforms[0].transform.translation.x = value
            return edit
        for which in ("base_link", "odom"):
            for factor in (NAN, 0.0, 2.0, 1e200):
                self.expect_named("quaternion times %g" % factor, ["invalid quaternion"], edit_tf=rotation(which, factor))
            self.expect_named("position NaN", ["nan value"], edit_tf=position(which, NAN))
            self.expect_named("position infinite", ["not finite"], edit_tf=position(which, float("inf")))
        for name, words, edit in (
                ("position", "not finite", lambda p: setattr(p.pose.pose.position, "x", NAN)),
                ("covariance", "covariance", lambda p: setattr(p.pose, "covariance", [NAN] * 36)),
                ("negative covariance", "covariance", lambda p: setattr(p.pose, "covariance", [-1.0] * 36)),
                ("quaternion", "length 0", lambda p: set_rotation(p.pose.pose.orientation, [0, 0, 0, 0]))):
            self.expect_named("start pose: " + name, ["initialpose refused", words], edit_pose=edit)

    def test_depth_images_that_are_odd_but_clear(self):
        def padded(message):
            row = 2 * WIDTH
            message.data = b"".join(message.data[row * v:row * (v + 1)] + b"\xff" * 6 for v in range(HEIGHT))
            message.step = row + 6
        big = fields(is_bigendian=1)
        for name, kind, edit in (("16UC1", "16UC1", same), ("mono16", "mono16", same), ("32FC1", "32FC1", same), ("padded", "16UC1", padded),
                                 ("16 big-endian", "16UC1", both(big, pixels("<u2", lambda v: v.astype(">u2")))),
                                 ("32 big-endian", "32FC1", both(big, pixels("<f4", lambda v: v.astype(">f4")))),
                                 ("compressed", "compressed", same),
                                 ("half of it negative", "32FC1", pixels("<f4", lambda v: np.where(np.arange(v.size) % 2, v, -v)))):
            self.expect_right(name, kind=kind, edit=edit)
        for name, edit in {"K of zeros": fields(K=[0] * 9), "P of zeros": fields(P=[0] * 12),
                           **{"%d coefficients" % n: fields(D=[0.0] * n) for n in (0, 3, 4, 5, 8, 12, 14)}}.items():
            self.expect_right(name, kind="16UC1", edit_info=edit)

    def test_depth_images_that_cannot_be_read_are_named(self):
        for name, words, kind, edit in (
                ("colours", "encoding 'bgr8'", "16UC1", fields(encoding="bgr8")),
                ("no encoding", "encoding ''", "16UC1", fields(encoding="")),
                ("control characters", "encoding '?[31m'", "16UC1", fields(encoding="\x1b[31m")),
                ("too little data", "pixels of 4 bytes", "16UC1", fields(encoding="32FC1")),
                ("step small", "in rows of 10", "16UC1", fields(step=10)),
                ("step 0", "in rows of 0", "16UC1", fields(step=0)),
                ("step huge", "in rows of 4294967295", "16UC1", fields(step=4294967295)),
                ("size huge", "4294967295 x 4294967295", "16UC1", fields(width=4294967295, height=4294967295))):
            self.expect_named(name, ["12 of 12 scans: topic 'camera/depth/image': depth image: ", words], kind=kind, edit=edit)
        self.expect_named("negative", ["no point between", "no reading at all"], kind="32FC1", edit=pixels("<f4", np.negative))

    def test_camera_info_that_is_none_is_named(self):
        for name, words, edit in (
                ("zeros", "focal lengths", fields(K=[0] * 9, P=[0] * 12)), ("negative", "focal lengths", projection(-55, -55, 31, 23)),
                ("NaN", "focal lengths", projection(NAN, NAN, NAN, NAN)), ("tiny", "1e-300", projection(1e-300, 1e-300, 31, 23)),
                ("huge", "1e+300", projection(1e300, 1e300, 31, 23)), ("ones", "focal lengths 1 and 1", projection(1, 1, 0, 0)),
                ("principal point of another camera", "principal point 640, 480", projection(55, 55, 640, 480)),
                ("principal point far away", "principal point 1e+300", projection(55, 55, 1e300, 23)),
                ("another size", "wanted the size of the depth image", fields(width=640, height=480)),
                ("no size", "wanted the size of the depth image", fields(width=0, height=0)),
                ("binning", "wanted the size of the depth image", fields(binning_x=4294967295, binning_y=4294967295))):
            self.expect_named(name, ["topic 'camera/depth/image': camera_info: ", words], kind="16UC1", edit_info=edit)

    def test_compressed_images_that_cannot_be_read_are_named(self):
        header = struct.pack("<iff", 0, 0, 0)
        for name, words, edit in (
                ("8 bytes", "cut off", lambda m: setattr(m, "data", m.data[:8])),
                ("header only", "cut off", lambda m: setattr(m, "data", m.data[:12])),
                ("half a PNG", "PNG: is cut off", lambda m: setattr(m, "data", m.data[:-200])),
                ("damaged PNG", "PNG: ", lambda m: setattr(m, "data", m.data[:40] + b"\xff" * 20 + m.data[60:])),
                ("no header", "Not a PNG", lambda m: setattr(m, "data", m.data[12:])),
                ("8 bits", "8 bits", fields(data=header + png(np.zeros((HEIGHT, WIDTH), np.uint8)))),
                ("JPEG", "jpeg", fields(format="16UC1; jpeg compressed bgr8")),
                ("RVL that is none", "a side", fields(format="16UC1; compressedDepth rvl"))):
            self.expect_named(name, ["topic 'camera/depth/image/compressedDepth': ", words], kind="compressed", edit=edit)
        for a, b in ((0.0, 0.0), (NAN, NAN), (-5000.0, 1e6)):
            self.expect_named("parameters %g %g" % (a, b), ["no point between"], kind="compressed", edit=lambda m: (
                setattr(m, "format", "32FC1; compressedDepth"), setattr(m, "data", struct.pack("<iff", 0, a, b) + m.data[12:])))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + sys.argv[3:], verbosity=1)
