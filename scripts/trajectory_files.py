"""Readers of trajectories: TUM files (per line: time x y z qx qy qz qw) and topics of bags with PoseStamped,
PoseWithCovarianceStamped, Odometry or Path messages, matched by their stamps."""

import numpy as np

import poses


class TrajectoryError(Exception):
    """A file or topic cannot be used; the text names it."""


class Trajectory:
    """Stamps [s], rising, and poses."""

    def __init__(self, source, stamps, transforms):
        if not stamps:
            raise TrajectoryError("%s: got no poses, wanted some" % source)
        order = np.argsort(stamps, kind="stable")
        self.stamps = np.asarray(stamps)[order]
        self.transforms = np.asarray(transforms)[order]

    def distance(self):
        return float(np.linalg.norm(np.diff(self.transforms[:, :3, 3], axis=0), axis=1).sum())


def from_quaternion(translation, quaternion):
    return poses.pose(poses.rotation_from_quaternion(quaternion), translation)


def read_tum(path):
    try:
        rows = np.loadtxt(path, ndmin=2)
    except (OSError, ValueError) as error:
        raise TrajectoryError("%s: %s" % (path, error)) from error
    if rows.shape[1] != 8:
        raise TrajectoryError("%s: got %d columns, wanted 8 (time x y z qx qy qz qw)" % (path, rows.shape[1]))
    return Trajectory(path, list(rows[:, 0]), [from_quaternion(row[1:4], row[4:8]) for row in rows])


def pose_of(message):
    """The geometry_msgs/Pose inside PoseStamped, PoseWithCovarianceStamped or Odometry."""
    pose = message.pose
    return pose.pose if hasattr(pose, "pose") else pose


def bag_messages(path, topic):
    import rosbag

    wanted = topic.lstrip("/")
    try:
        with rosbag.Bag(path) as bag:
            names = [name for name in bag.get_type_and_topic_info().topics if name.lstrip("/") == wanted]
            if not names:
                raise TrajectoryError("%s: got no topic '%s', wanted it" % (path, topic))
            return [(message, time) for _, message, time in bag.read_messages(topics=names)]
    except (OSError, rosbag.ROSBagException) as error:
        raise TrajectoryError("%s: %s" % (path, error)) from error


def read_bag(path, topic):
    stamps, transforms = [], []
    for message, _ in bag_messages(path, topic):
        for each in (getattr(message, "poses", None) or [message]):
            p = pose_of(each)
            stamps.append(each.header.stamp.to_sec())
            transforms.append(from_quaternion([p.position.x, p.position.y, p.position.z],
                                              [p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w]))
    return Trajectory("%s:%s" % (path, topic), stamps, transforms)


def read_trajectory(source):
    if ".bag:" in source:
        path, topic = source.split(".bag:", 1)
        return read_bag(path + ".bag", topic)
    if source.endswith(".bag"):
        raise TrajectoryError("%s: got a bag without a topic, wanted %s:TOPIC" % (source, source))
    return read_tum(source)


def match(truth, estimate, tolerance):
    """Index pairs of poses whose stamps differ by at most `tolerance` [s]; each estimate is used once."""
    pairs = []
    used = -1
    for i, stamp in enumerate(truth.stamps):
        j = int(np.searchsorted(estimate.stamps, stamp))
        candidates = [k for k in (j - 1, j) if used < k < len(estimate.stamps)]
        if not candidates:
            continue
        nearest = min(candidates, key=lambda k: abs(estimate.stamps[k] - stamp))
        if abs(estimate.stamps[nearest] - stamp) <= tolerance:
            pairs.append((i, nearest))
            used = nearest
    return pairs
