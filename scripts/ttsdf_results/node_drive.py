"""localization_node beside that of another build: the same scans at real speed, in turn, several times.

The bag has organised clouds (all that older nodes read), odometry with drift and the start pose. How old a scan is when its
pose is out: from the receipt of the true pose, which the bag holds just before the scan, to the receipt of the pose.
"""

import os
import signal
import statistics
import subprocess
import sys
import threading
import time

import numpy as np

from .store import ROOT, StepError
from .text import markdown

CLOUD = "camera/depth/points"
HEAD = ["node", "processor time per scan [ms]", "age of the scan: median, 90 % [ms]", "resident at the end, largest [MB]",
        "scans, poses"]


def cloud_of(image, info):
    """As depth_image_proc makes it: points of 16 bytes, NaN where nothing was measured."""
    from sensor_msgs.msg import PointCloud2, PointField
    depth = np.frombuffer(image.data, "<u2").reshape(image.height, image.width) / np.float32(1000.0)
    v, u = np.indices(depth.shape)
    points = np.zeros((*depth.shape, 4), "<f4")
    points[..., :3] = np.stack([(u - info.K[2]) / info.K[0] * depth, (v - info.K[5]) / info.K[4] * depth, depth], axis=-1)
    points[depth == 0, :3] = np.nan
    fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    return PointCloud2(header=image.header, height=image.height, width=image.width, fields=fields, point_step=16,
                       row_step=16 * image.width, data=points.tobytes())


def bag_of_clouds(frames, folder):
    import rosbag
    depth, bag = folder / "depth.bag", folder / "clouds.bag"
    subprocess.run([str(ROOT / "scripts" / "frames_to_bag"), frames, str(depth), "--every", "5", "--offset", "3", "--rate", "10"],
                   check=True, stderr=subprocess.DEVNULL)
    info = None
    with rosbag.Bag(str(depth)) as source, rosbag.Bag(str(bag), "w") as target:
        for topic, message, stamp in source:
            if topic.endswith("camera_info"):
                info = message
            elif topic.endswith("image_rect"):
                target.write(CLOUD, cloud_of(message, info), stamp)
            else:
                target.write(topic, message, stamp)
    depth.unlink()
    return bag


class Receipts:
    """When the true pose and the estimated one of each stamp came."""

    def __init__(self):
        import rospy
        from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
        rospy.init_node("results", disable_signals=True, disable_rostime=True)
        self.lock = threading.Lock()
        self.clear()
        for topic, kind in (("ground_truth", PoseStamped), ("pose", PoseWithCovarianceStamped)):
            rospy.Subscriber(topic, kind, self.receive, topic, queue_size=1000, tcp_nodelay=True)

    def clear(self):
        with self.lock:
            self.times = {"ground_truth": {}, "pose": {}}

    def receive(self, message, topic):
        now = time.monotonic()
        with self.lock:
            self.times[topic].setdefault(message.header.stamp.to_nsec(), now)

    def ages(self):
        with self.lock:
            truth, pose = self.times["ground_truth"], self.times["pose"]
            return len(truth), [1e3 * (pose[stamp] - truth[stamp]) for stamp in truth if stamp in pose]


def cpu_seconds(pid):
    with open(f"/proc/{pid}/stat") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def one_run(build, tt_map, bag, environment, receipts, settled):
    """(processor time per scan [ms], ages [ms], resident, largest [MB], scans) of one node and one bag."""
    libraries = {"LD_LIBRARY_PATH": f"{build}/devel/lib:" + environment.get("LD_LIBRARY_PATH", "")}
    node = subprocess.Popen([f"{build}/devel/lib/ttsdf_localization/localization_node", "__name:=localization", f"cloud:={CLOUD}",
                             f"_map_file:={os.path.abspath(tt_map)}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                            env={**environment, **libraries})
    try:
        settled(node.pid)
        receipts.clear()
        before = cpu_seconds(node.pid)
        subprocess.run(["rosbag", "play", "--clock", "--quiet", "--delay", "2", str(bag)], env=environment, check=True,
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        time.sleep(0.5)
        if node.poll() is not None:
            raise StepError("localization_node ended by itself")
        used, (resident, _, largest) = cpu_seconds(node.pid) - before, settled(node.pid)
        scans, ages = receipts.ages()
        if not ages:
            raise StepError(f"got no pose from the node of {build}")
        return 1e3 * used / scans, ages, resident, largest, scans
    finally:
        node.send_signal(signal.SIGINT)
        node.wait(timeout=60)


def measured(nodes, bag, rounds, environment, settled):
    """`nodes`: name -> (build folder, map). Rows of a table and figures: the medians of the rounds."""
    os.environ.update(environment)
    subprocess.run(["rosparam", "set", "/use_sim_time", "true"], env=environment, check=True)
    receipts, runs = Receipts(), {name: [] for name in nodes}
    for number in range(rounds):
        for name in list(nodes)[::-1 if number % 2 else 1]:
            runs[name].append(one_run(*nodes[name], bag, environment, receipts, settled))
            cpu, ages, resident, _, _ = runs[name][-1]
            print(f"{name}: {cpu:.2f} ms per scan, age {statistics.median(ages):.2f} ms, {resident:.1f} MB", file=sys.stderr)
    figures = {}
    for name, all_of in runs.items():
        middle = {"cpu_ms": [run[0] for run in all_of], "age_ms": [statistics.median(run[1]) for run in all_of],
                  "age_90_ms": [float(np.percentile(run[1], 90)) for run in all_of], "resident": [run[2] for run in all_of],
                  "largest": [run[3] for run in all_of], "scans": [run[4] for run in all_of],
                  "poses": [len(run[1]) for run in all_of]}
        figures[name] = {key: statistics.median(values) for key, values in middle.items()}
    rows = [[name, f"{f['cpu_ms']:.2f}", f"{f['age_ms']:.2f}, {f['age_90_ms']:.2f}", f"{f['resident']:.1f}, {f['largest']:.1f}",
             f"{f['scans']:.0f}, {f['poses']:.0f}"] for name, f in figures.items()]
    return markdown(HEAD, rows), figures
