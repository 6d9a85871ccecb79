"""A ROS master and logs of its own: nothing here meets another roscore of this machine."""

import contextlib
import random
import socket
import subprocess
import tempfile

from .store import StepError


def free_port():
    for port in random.sample(range(12000, 30000), 1000):
        with socket.socket() as one, contextlib.suppress(OSError):
            one.bind(("", port))
            return port
    raise StepError("got no free TCP port, wanted one for a ROS master")


class Ros:
    """The development space's environment, with a private master."""

    def __init__(self, build):
        setup = build / "devel" / "setup.bash"
        if not setup.exists():
            raise StepError(f"got no {setup}, wanted a build with ROS (scripts/build)")
        text = subprocess.run(["bash", "-c", f". '{setup}' && env -0"], stdout=subprocess.PIPE, check=True).stdout.decode()
        self.environment = dict(item.split("=", 1) for item in text.split("\0") if "=" in item)
        self.port = free_port()
        self.home = tempfile.TemporaryDirectory(prefix="ttsdf_results_ros_")
        self.environment.update(ROS_MASTER_URI=f"http://localhost:{self.port}", ROS_HOSTNAME="localhost",
                                ROS_HOME=self.home.name, ROS_LOG_DIR=self.home.name + "/log")
