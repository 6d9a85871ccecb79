"""Drives a simulated robot round a room for as long as you like and watches the localization node: memory, CPU, latency,
stamps of its transforms, errors against the truth. Ends with exit code 1 if one of its limits is not kept.

Two phases, each with a node of its own:
  drive    as many scans as --scans says, each sent as soon as the one before is answered, in simulated time at 30 Hz:
           the resident memory after the first minute of driving against the end, transforms, errors, times lost
  load     organised clouds of 640 x 480 points at 30 Hz in real time for --seconds: CPU and latency, and the transforms
           as tf_monitor sees them: rate, order of the stamps, delay (negative: stamped ahead), longest silence

Needs a built and sourced workspace with its tests (make_room_map), e.g. after scripts/build and
source build/devel/setup.bash.
"""

import argparse
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "test", "ros"))

RATE = 30.0           # scans per second, in the clock of the stamps
POSES = 360           # on the closed path
MEMORY_GROWTH = 1.0   # [MB] allowed after the first minute
CPU_LIMIT = 35.0      # [% of one core]


def parse_arguments(arguments):
    parser = argparse.ArgumentParser(prog="results long_drive", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scans", type=int, default=50000, help="of the phase drive (default 50000)")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the phase load (default 60; 0: leave it out)")
    parser.add_argument("--width", type=int, default=64, help="columns of the clouds of the phase drive (default 64)")
    options = parser.parse_args(arguments)
    if options.scans < 0 or options.seconds < 0.0:
        parser.error("got --scans %d --seconds %g, wanted 0 or more" % (options.scans, options.seconds))
    return options


def package_program(name):
    import roslib.packages
    found = roslib.packages.find_node("ttsdf_localization", name)
    if not found:
        sys.exit("long_drive: error: no program %s: build the workspace with its tests, and source it" % name)
    return found[0]


class World:
    """A ROS master of its own and a map of the room."""

    def __enter__(self):
        with socket.socket() as free:
            free.bind(("", 0))
            port = free.getsockname()[1]
        self.folder = tempfile.TemporaryDirectory(prefix="ttsdf_long_drive_")
        os.environ.update(ROS_MASTER_URI="http://localhost:%d" % port, ROS_HOSTNAME="localhost",
                          ROS_HOME=self.folder.name, ROS_LOG_DIR=self.folder.name)
        self.master = subprocess.Popen(["roscore", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.map = os.path.join(self.folder.name, "room.ttsdf")
        subprocess.run([package_program("make_room_map"), self.map, "40"], check=True)
        return self

    def __exit__(self, *_):
        self.master.send_signal(signal.SIGINT)
        self.master.wait()
        self.folder.cleanup()


class Node:
    """localization_node, and what /proc says about it."""

    def __init__(self, map_file):
        import rospy
        rospy.set_param("/use_sim_time", True)
        rospy.set_param("localization", {"map_file": map_file})
        self.process = subprocess.Popen([package_program("localization_node"), "__name:=localization"],
                                        stdout=subprocess.DEVNULL)

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait()

    def megabytes(self):
        with open("/proc/%d/status" % self.process.pid) as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) / 1024.0

    def cpu_seconds(self):
        with open("/proc/%d/stat" % self.process.pid) as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Robot:
    """A closed path round the room; odometry that drifts by 2 % of the way in a direction that wanders."""

    def __init__(self, width, repeat):
        import room
        self.path, self.scans = [], []
        for n in range(POSES):
            phase = 2.0 * np.pi * n / POSES
            T = room.pose(2.6 + 1.1 * np.cos(phase), 2.4 + 0.7 * np.sin(phase), 0.0, phase + 0.4 * np.sin(2.0 * phase))
            self.path.append(T)
        self.width, self.repeat = width, repeat
        self.random = np.random.RandomState(1)
        self.T_map_odom = room.pose(0.3, -0.2, 0.0, 0.1)
        self.room = room

    def scan(self, n):
        """Rendered when first asked for."""
        n %= len(self.path)
        while len(self.scans) <= n:
            T = self.path[len(self.scans)] @ self.room.T_BASE_CAMERA
            self.scans.append(self.room.scan(T, self.width, 3 * self.width // 4))
        points = self.scans[n]
        return np.kron(points, np.ones((self.repeat, self.repeat, 1), np.float32)) if self.repeat > 1 else points

    def step(self, n):
        """True pose and odometry of scan n."""
        T = self.path[n % len(self.path)]
        way = np.linalg.norm((T - self.path[(n - 1) % len(self.path)])[:3, 3])
        slip = self.room.pose(*(0.02 * way * self.random.normal(size=2)), 0.0, 0.02 * way * self.random.normal())
        self.T_map_odom = T @ slip @ np.linalg.inv(T) @ self.T_map_odom
        return T, np.linalg.inv(self.T_map_odom) @ T


class Drive:
    """Sends scans and collects what comes back."""

    def __init__(self, robot):
        import rospy
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import PointCloud2
        from tf2_msgs.msg import TFMessage

        import fake_robot
        self.rospy, self.tools, self.robot = rospy, fake_robot, robot
        self.clock = rospy.Publisher("/clock", Clock, queue_size=10)
        self.tf = rospy.Publisher("/tf", TFMessage, queue_size=50)
        self.clouds = rospy.Publisher("cloud", PointCloud2, queue_size=2)
        self.changed = threading.Condition()
        self.answers, self.stamps, self.arrivals, self.not_rising, self.sent = {}, [], [], 0, {}
        self.errors, self.latencies, self.times_lost, self.refused = [], [], 0, 0
        self.truth, self.state, self.time, self.count = {}, None, 1000.0, 0
        rospy.Subscriber("status", fake_robot.Status, self.on_status, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber("pose", fake_robot.PoseWithCovarianceStamped, self.on_pose, queue_size=1000)
        rospy.Subscriber("/tf", TFMessage, self.on_tf, queue_size=1000)
        fake_robot.StaticTransforms.send(fake_robot.transform("base_link", "camera", robot.room.T_BASE_CAMERA,
                                                              rospy.Time()))

    def on_status(self, status):
        now = time.monotonic()
        with self.changed:
            if status.state == status.LOST and self.state != status.LOST:
                self.times_lost += 1
            self.state = status.state
            stamp = status.header.stamp.to_nsec()
            if stamp in self.sent:
                self.latencies.append(now - self.sent.pop(stamp))
                self.refused += not status.pose_valid
                self.answers[stamp] = status
            self.changed.notify_all()

    def on_pose(self, pose):
        T = self.tools.matrix(pose.pose.pose.position, pose.pose.pose.orientation)
        with self.changed:
            truth = self.truth.pop(pose.header.stamp.to_nsec(), None)
            if truth is not None:
                self.errors.append(self.tools.errors(T, truth)[0])

    def on_tf(self, message):
        for t in message.transforms:
            if t.child_frame_id == "odom":
                if self.stamps and t.header.stamp <= self.stamps[-1]:
                    self.not_rising += 1
                self.stamps.append(t.header.stamp)
                self.arrivals.append(time.monotonic())

    def send(self):
        """Scan number `count`; returns its stamp."""
        stamp = self.rospy.Time.from_sec(round(self.time, 6))
        T, T_odom_base = self.robot.step(self.count)
        points = self.robot.scan(self.count)
        from rosgraph_msgs.msg import Clock
        self.clock.publish(Clock(stamp))
        self.tf.publish([self.tools.transform("odom", "base_link", T_odom_base, stamp)])
        message = self.tools.cloud_message(points, "camera", stamp)
        with self.changed:
            self.truth[stamp.to_nsec()] = T
            self.sent[stamp.to_nsec()] = time.monotonic()
        self.clouds.publish(message)
        self.time += 1.0 / RATE
        self.count += 1
        return stamp.to_nsec()

    def wait(self, stamp, seconds=5.0):
        with self.changed:
            return self.changed.wait_for(lambda: stamp in self.answers, seconds)

    def start(self):
        """Gives the pose, and scans until the node tracks."""
        poses = self.rospy.Publisher("initialpose", self.tools.PoseWithCovarianceStamped, queue_size=2)
        end = time.monotonic() + 60.0
        told = False
        while self.state != self.tools.Status.TRACKING:
            if time.monotonic() > end:
                sys.exit("long_drive: error: the node does not track after 60 s")
            if not told and self.state == self.tools.Status.WAITING_FOR_POSE and poses.get_num_connections():
                poses.publish(self.tools.pose_message(self.robot.path[self.count % len(self.robot.path)]))
                told = True
            self.wait(self.send(), 0.5)
        with self.changed:
            self.errors, self.latencies, self.times_lost, self.refused = [], [], 0, 0


def drive(world, options):
    robot = Robot(options.width, 1)
    for n in range(POSES):
        robot.scan(n)
    node, driver = Node(world.map), Drive(robot)
    driver.start()
    begin, after_a_minute, last = time.monotonic(), None, driver.count + options.scans
    cpu_before = node.cpu_seconds()
    first, silent = driver.count, 0
    while driver.count < last:
        silent += not driver.wait(driver.send())
        if after_a_minute is None and driver.count - first >= 60.0 * RATE:
            after_a_minute = node.megabytes()
        if driver.count % 5000 == 0:
            sys.stderr.write("%d of %d scans, %.1f MB\n" % (driver.count - first, options.scans, node.megabytes()))
        driver.answers.clear()
    seconds, megabytes = time.monotonic() - begin, node.megabytes()
    cpu = node.cpu_seconds() - cpu_before
    node.stop()
    errors = np.array(driver.errors)
    print("drive: %d scans (%.1f minutes of driving) in %.0f s" % (options.scans, options.scans / RATE / 60.0, seconds))
    print("  without an answer          %d" % silent)
    print("  refused, times lost        %d, %d" % (driver.refused, driver.times_lost))
    print("  error of the position      rmse %.1f mm, max %.1f mm" % (1e3 * np.sqrt(np.mean(errors ** 2)),
                                                                  1e3 * errors.max()))
    print("  transforms, not rising     %d, %d" % (len(driver.stamps), driver.not_rising))
    print("  CPU per scan               %.2f ms" % (1e3 * cpu / options.scans))
    growth = 0.0
    if after_a_minute is None:
        print("  resident memory            %.1f MB at the end (less than a minute of driving)" % megabytes)
    else:
        growth = megabytes - after_a_minute
        print("  resident memory            %.1f MB after the first minute of driving, %.1f MB at the end" % (
            after_a_minute, megabytes))
    return silent == 0 and driver.times_lost == 0 and driver.not_rising == 0 and growth <= MEMORY_GROWTH


def load(world, options):
    robot = Robot(160, 4)
    robot.path = robot.path[::12]
    clouds = [robot.scan(n) for n in range(len(robot.path))]  # large: few of them, and the robot waits at each
    robot.path = [T for T in robot.path for _ in range(12)]
    robot.scans = [points for points in clouds for _ in range(12)]
    robot.repeat = 1
    node, driver = Node(world.map), Drive(robot)
    driver.start()
    cpu, begin, sent = node.cpu_seconds(), time.monotonic(), 0
    transforms, stamp_begin, earlier = len(driver.stamps), driver.time, driver.not_rising
    while time.monotonic() - begin < options.seconds:
        driver.send()
        sent += 1
        time.sleep(max(0.0, begin + sent / RATE - time.monotonic()))
    seconds, cpu = time.monotonic() - begin, node.cpu_seconds() - cpu
    megabytes = node.megabytes()
    node.stop()
    milliseconds = 1e3 * np.array(driver.latencies)
    percent = 100.0 * cpu / seconds
    arrivals = np.array(driver.arrivals[transforms:]) - begin
    delays = arrivals - (np.array([s.to_sec() for s in driver.stamps[transforms:]]) - stamp_begin)
    not_rising = driver.not_rising - earlier
    print("load: %d clouds of 640 x 480 points in %.0f s, over TCP" % (sent, seconds))
    print("  answered, times lost       %d, %d" % (len(milliseconds), driver.times_lost))
    print("  CPU                        %.1f %% of one core" % percent)
    print("  sent to answered           median %.1f ms, 99 %% %.1f ms (with Python's part at both ends)" % (
        np.median(milliseconds), np.percentile(milliseconds, 99)))
    print("  transforms, not rising     %d, %d; %.0f per second, longest silence %.0f ms" % (
        len(delays), not_rising, len(delays) / seconds, 1e3 * np.diff(arrivals).max()))
    print("  delay of the transforms    median %.1f ms, 99 %% %.1f ms, most %.1f ms" % (
        1e3 * np.median(delays), 1e3 * np.percentile(delays, 99), 1e3 * delays.max()))
    print("  resident memory            %.1f MB" % megabytes)
    return driver.times_lost == 0 and not_rising == 0 and delays.max() < 0.0 and percent <= CPU_LIMIT


def main(arguments):
    options = parse_arguments(arguments)
    good = True
    with World() as world:
        import rospy
        rospy.init_node("long_drive", disable_rostime=True, disable_signals=True)
        if options.scans:
            good = drive(world, options) and good
        if options.seconds:
            good = load(world, options) and good
        rospy.signal_shutdown("done")
    print("every limit kept" if good else "NOT every limit kept")
    return 0 if good else 1

