#!/usr/bin/python3
"""The commands of the pages for beginners: what needs no camera, no screen and no ROS master is run in order in an empty folder;
of launch files the arguments are checked, of services their fields.

usage: commands_test.py TOOLS      (folder of ttsdf_build and the others)
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PAGES = ("install", "first_map", "first_localization", "own_camera", "bags", "tuning")
RUN = ("first_map", "first_localization", "bags")  # in this order, in one folder
# Each with what keeps it true instead: a running system of ROS, or the whole machine.
NOT_RUN = ("roslaunch", "rosservice", "rostopic", "rosbag", "rosparam", "catkin_make", ".", "export",
           "/usr/lib/dynamic_reconfigure/dynparam")
# What only a camera or the node of a command that is not run would have written.
NOT_THERE = ("run.bag", "poses.bag")
CUBE = """OFF
8 12 0
0 0 0\n4 0 0\n0 3 0\n4 3 0\n0 0 2\n4 0 2\n0 3 2\n4 3 2
3 0 2 1\n3 1 2 3\n3 4 5 6\n3 5 7 6\n3 0 1 4\n3 1 5 4\n3 2 6 3\n3 3 6 7\n3 0 4 2\n3 2 4 6\n3 1 3 5\n3 3 7 5
"""


def commands(page):
    """Of the page's shell blocks, continued lines joined, comments left out."""
    text = (REPOSITORY / "doc" / f"{page}.md").read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for line in block.replace("\\\n", " ").splitlines():
            line = re.sub(r"\s+#.*", "", line).strip()
            if line and not line.startswith("#"):
                yield line


class Commands(unittest.TestCase):
    tools = ""

    def test_what_needs_no_system_of_ros_runs(self):
        environment = dict(os.environ, PATH=f"{self.tools}:{os.environ['PATH']}")
        with tempfile.TemporaryDirectory(prefix="ttsdf_commands_") as folder:
            (pathlib.Path(folder) / "scripts").symlink_to(REPOSITORY / "scripts")
            (pathlib.Path(folder) / "room.off").write_text(CUBE)
            ran = 0
            ros = (pathlib.Path(self.tools) / "offline_localizer").exists()  # a build without ROS has none
            for page in RUN if ros else RUN[:2]:
                for line in commands(page):
                    if shlex.split(line)[0] in NOT_RUN or any(name in line for name in NOT_THERE):
                        continue
                    line = line.replace("FOLDER", "frames").replace("--mesh room.ply --output room.ttsdf",
                                                                    "--mesh room.off --output mesh.ttsdf")
                    result = subprocess.run(["bash", "-c", line], cwd=folder, env=environment, stdout=subprocess.PIPE,
                                            stderr=subprocess.STDOUT, universal_newlines=True, timeout=300)
                    self.assertEqual(result.returncode, 0, f"{page}: {line}\n{result.stdout}")
                    ran += 1
            self.assertGreaterEqual(ran, 8)
            poses = (pathlib.Path(folder) / "poses.csv").read_text().splitlines()
            columns = poses[0].split(",")
            self.assertEqual([columns[n - 1] for n in (1, 4, 17, 18)],
                             ["scan", "success", "translation_error", "rotation_error"])
            good = [row.split(",") for row in poses[1:] if row.split(",")[3] == "1"]
            self.assertGreater(len(good), 0.9 * (len(poses) - 1))
            if ros:
                self.assertGreater(len((pathlib.Path(folder) / "poses.txt").read_text().splitlines()), 90)

    def test_every_program_and_script_exists(self):
        for page in PAGES:
            for line in commands(page):
                word = shlex.split(line)[0]
                if word.startswith("scripts/"):
                    self.assertTrue((REPOSITORY / word).exists(), f"{page}: {line}")
                elif word not in NOT_RUN and word not in ("cut", "offline_localizer"):
                    self.assertTrue((pathlib.Path(self.tools) / word).exists(), f"{page}: {line}")

    def test_services_have_the_fields_that_pages_give(self):
        seen = 0
        for page in PAGES:
            for line in commands(page):
                words = shlex.split(line)
                if words[:2] != ["rosservice", "call"]:
                    continue
                name = "".join(word.capitalize() for word in words[2].split("/")[-1].split("_"))
                request = (REPOSITORY / "srv" / f"{name}.srv").read_text(encoding="utf-8").partition("\n---")[0]
                for field in re.findall(r"(\w+):", words[3]):
                    self.assertRegex(request, rf"(?m)^\S+ +{field}\b", f"{page}: {line}")
                    seen += 1
        self.assertGreaterEqual(seen, 3)

    def test_launch_files_have_the_arguments_that_pages_give(self):
        for page in PAGES:
            for line in commands(page):
                words = shlex.split(line)
                if words[0] != "roslaunch" or len(words) < 3:
                    continue
                file = REPOSITORY / "launch" / words[2]
                self.assertTrue(file.exists(), f"{page}: {line}")
                known = {arg.get("name") for arg in xml.etree.ElementTree.parse(file).getroot().findall("arg")}
                for word in words[3:]:
                    name, assigned, _ = word.partition(":=")
                    if assigned:
                        self.assertIn(name, known, f"{page}: {line}")


if __name__ == "__main__":
    Commands.tools = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
