"""Pictures of README and doc from the present build.

usage: scripts/results pictures [registration] [menu] [--data FOLDER] [--output FOLDER] [--store FOLDER]

  registration    a scan of the red kitchen (red) in its map (grey), from above, before and after (--data or $TTSDF_TEST_DATA)
  menu            the operator's menu in rviz (scripts/screenshot: no screen needed, a build with ROS)
  --output FOLDER where they go (default doc/images)

Without a name: all of them.
"""

import argparse
import csv
import os
import pathlib
import subprocess
import tempfile

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import poses
from depth_frames import FrameFolder

from . import protocol, scenes, small_cloud
from .evaluate import parts_failed
from .store import ROOT, Store, StepError, tools_folder

PIXELS_PER_METRE = 110.0
TITLE_PIXELS = 36  # above a picture
FONT_FILE = pathlib.Path("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf")
FONT = ImageFont.truetype(str(FONT_FILE), 22) if FONT_FILE.exists() else ImageFont.load_default()
LIGHT = np.array([-0.4, 0.5, 0.8]) / np.linalg.norm([-0.4, 0.5, 0.8])


def view(down):
    """Rotation of the map into the picture: x right, y up the page, z towards the eye; tilted 35 degrees from straight down."""
    up = -np.asarray(down) / np.linalg.norm(down)
    side = np.cross(np.eye(3)[2] if abs(up[2]) < 0.9 else np.eye(3)[0], up)
    side /= np.linalg.norm(side)
    flat = np.array([side, np.cross(up, side), up])
    tilt = np.deg2rad(35.0)
    return np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]]) @ flat


class Canvas:
    """A depth buffer that points are dropped into, shaded by the slope of what lies in it."""

    def __init__(self, R, clouds, margin=0.2):
        """`clouds`: all that has to fit in."""
        ends = [np.percentile((points @ R.T)[:, :2], (0.2, 99.8), axis=0) for points in clouds]  # without what lies far out
        low, high = np.min([end[0] for end in ends], axis=0), np.max([end[1] for end in ends], axis=0)
        self.R, self.low = R, low - margin
        size = (PIXELS_PER_METRE * (high + margin - self.low)).astype(int) + 1
        self.depth = np.full((size[1], size[0]), -np.inf)

    def places(self, points):
        seen = points @ self.R.T
        pixel = (PIXELS_PER_METRE * (seen[:, :2] - self.low)).astype(int)
        inside = np.all((pixel >= 1) & (pixel < np.array(self.depth.shape)[::-1] - 1), axis=1)
        return pixel[inside], seen[inside, 2]

    def drop(self, points):
        pixel, height = self.places(points)
        for dx in (-1, 0, 1):
            for dy in (-1, 0, 1):
                np.maximum.at(self.depth, (pixel[:, 1] + dy, pixel[:, 0] + dx), height)

    def image(self, scan):
        known = np.isfinite(self.depth)
        filled = np.where(known, self.depth, np.min(self.depth[known]))
        dy, dx = np.gradient(filled, 1.0 / PIXELS_PER_METRE)
        normal = np.stack((-dx, -dy, np.ones_like(dx)), axis=-1)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        grey = np.where(known, 70.0 + 150.0 * np.clip(normal @ LIGHT, 0.0, 1.0), 255.0)
        picture = np.repeat(grey[..., None], 3, axis=-1)
        pixel, height = self.places(scan)
        visible = height > filled[pixel[:, 1], pixel[:, 0]] - 0.15
        for dx in (0, 1):
            for dy in (0, 1):
                picture[pixel[visible, 1] + dy, pixel[visible, 0] + dx] = (215, 25, 28)
        return Image.fromarray(picture[::-1].astype(np.uint8))


def without_ceiling(points, down, keep=2.0):
    """Points up to this height above the floor [m]."""
    height = -points @ (np.asarray(down) / np.linalg.norm(down))
    return points[height < np.percentile(height, 1.0) + keep]


def registered(tools, tt_map, folder, scan, prior):
    """Pose of the scan, by ttsdf_register."""
    scan.astype("<f4").tofile(folder / "scan.bin")
    np.savetxt(folder / "prior.txt", prior)
    (folder / "list.txt").write_text("scan.bin prior.txt\n")
    subprocess.run([str(tools / "ttsdf_register"), "--map", str(tt_map), "--batch", str(folder / "list.txt"), "--output",
                    str(folder / "out.csv")], check=True, stdout=subprocess.DEVNULL)
    with (folder / "out.csv").open() as file:
        row = next(csv.DictReader(file))
    if row["success"] != "1":
        raise StepError(f"picture: the scan was not registered: {row['reason']}")
    return poses.pose(poses.rotation_from_quaternion([float(row[k]) for k in ("qx", "qy", "qz", "qw")]),
                      [float(row[k]) for k in ("tx", "ty", "tz")])


def registration(data, store, output, index=525):
    there, _ = scenes.available(data, ("redkitchen",))
    if not there:
        raise StepError("got no redkitchen/, wanted --data FOLDER")
    scene = there[0]
    builder = protocol.SceneProtocol(scene, data, protocol.Plan())
    tt_map = store.run(builder.build("r40", "--max-rank", 40)) / protocol.MAP
    folder = FrameFolder(pathlib.Path(data) / scene.source)
    down = [float(word) for word in scene.down.split(",")]
    room = without_ceiling(small_cloud.map_points(folder, 10, 0, scene.depth_scale), down)
    truth, scan = folder.pose(index), small_cloud.points_of(folder.depth(index), folder.K, scene.depth_scale, stride=5)
    prior = truth @ poses.pose(poses.exp_so3([0.1, 0.2, 0.1]), [0.35, -0.1, 0.35])
    work = store.folder / "pictures"
    work.mkdir(parents=True, exist_ok=True)
    found = registered(store.tools, tt_map, work, scan, prior)
    scans = [without_ceiling(scan @ T[:3, :3].T + T[:3, 3], down, 3.0) for T in (prior, found)]
    canvas = Canvas(view(down), [room, *scans])
    canvas.drop(room)
    parts = [canvas.image(points) for points in scans]
    both = Image.new("RGB", (2 * parts[0].width, parts[0].height + TITLE_PIXELS), "white")
    for column, (title, part) in enumerate(zip(("scan (red), prior 0.5 m and 0.24 rad off", "scan (red), registered"), parts)):
        both.paste(part, (column * part.width, TITLE_PIXELS))
        ImageDraw.Draw(both).text((column * part.width + 12, 6), title, fill=(0, 0, 0), font=FONT)
    both.quantize(64).save(output / "registration.png", optimize=True)


def from_above(config):
    """Text of an rviz configuration whose view looks down on the robot: over a wall, and with room for the status text."""
    for value, other in (("      Pitch: 0.35\n", "      Pitch: 0.9\n"), ("      Distance: 3\n", "      Distance: 3.7\n")):
        if config.count(value) != 1:
            raise StepError(f"picture: got no view with '{value.strip()}', wanted one in rviz/localization.rviz")
        config = config.replace(value, other)
    return config


def menu(output):
    still = ("for n in $(seq 150); do rostopic echo -n 1 /status/state_name | grep -q tracking && break; sleep 1; done; sleep 10; "
             "rosservice call /camera/stand_still 'data: true' && sleep 5")
    with tempfile.NamedTemporaryFile("w", suffix=".rviz") as config:
        config.write(from_above((ROOT / "rviz" / "localization.rviz").read_text()))
        config.flush()
        subprocess.run([str(ROOT / "scripts" / "screenshot"), "--wait", "5", "--menu", "--before", still, config.name,
                        str(output / "menu.png"), "--", "roslaunch", "ttsdf_localization", "demo.launch", "operator_menu:=true",
                        "scene:=room", "mapping_seconds:=30", "localization_seconds:=200"], check=True)


@parts_failed("pictures")
def main(arguments):
    parser = argparse.ArgumentParser(prog="results pictures", description=__doc__, usage=argparse.SUPPRESS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help=argparse.SUPPRESS)
    parser.add_argument("--data", default=os.environ.get("TTSDF_TEST_DATA"), help=argparse.SUPPRESS)
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "doc" / "images", help=argparse.SUPPRESS)
    parser.add_argument("--store", type=pathlib.Path, help=argparse.SUPPRESS)
    a = parser.parse_args(arguments)
    unknown = set(a.names) - {"registration", "menu"}
    if unknown:
        raise StepError(f"got '{', '.join(sorted(unknown))}', wanted registration or menu")
    names = a.names or ("registration", "menu")
    a.output.mkdir(parents=True, exist_ok=True)
    build, tools = tools_folder("ttsdf_register", "ttsdf_build")
    if "registration" in names:
        registration(a.data, Store((a.store or build / "evaluation").resolve(), tools), a.output)
    if "menu" in names:
        menu(a.output)
    return 0
