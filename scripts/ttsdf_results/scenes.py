"""The scenes that figures come from: which frames are mapped, which are scans, and how each folder is read.

Scans are never frames of the map. Real data lies in one folder, $TTSDF_TEST_DATA or --data; scenes that are not there
are left out with a word. Simulated scenes are always there, and their poses are exact.
"""

import pathlib
import re
from dataclasses import dataclass, replace

from .store import OUT, Step

GRAVITY_FILE = "gravity-direction.txt"
# Where the surfaces of frames 1/15 s apart agree best (7.5 mm; 9.4 mm at 0, 10.5 mm at -0.04 s).
TUM_CLOCK = "-0.018"


class SceneError(Exception):
    pass


@dataclass(frozen=True)
class Scene:
    name: str
    what: str                  # for the reader of a table
    source: str = ""           # folder below the data folder; "" for a simulated scene
    layout: str = "frames"     # frames, or how frames_from reads it: tum, log, list
    reading: tuple = ()        # further options of frames_from
    simulation: tuple = ()     # options of ttsdf_simulate
    depth_scale: float = 1000.0
    mapped: tuple = (10, 0)    # frames of the map: every, offset
    scans: tuple = (10, 5)     # candidates of scans: every, offset
    last: int = 1000           # indices are below this
    map_options: tuple = ()    # of ttsdf_build, where its defaults do not fit the scale
    cloud_cell: float = 0.05   # of the point cloud map [m]
    max_depth: float = 4.0     # of scans [m]
    down: str = ""             # down direction in the map frame, if it is known

    @property
    def simulated(self):
        return not self.source

    def scan_selection(self, count):
        """(every, offset) for about `count` scans, evenly over the sequence."""
        every, offset = self.scans
        step = max(1, round(self.last / every / count))
        return every * step, offset


def simulated(name, what, *options, frames=1000, **settings):
    return Scene(name, what, simulation=("--frames", frames, *options), last=frames, down="0,0,-1", **settings)


TABLETOP = ("--voxel-size", "0.01", "--truncation", "0.03")
FIVE = {"mapped": (2, 0), "scans": (2, 1), "last": 5}

SMALL_CAMERA = ("--width", 320, "--height", 240, "--fx", 262.5, "--fy", 262.5)

SCENES = (
    Scene("redkitchen", "7-Scenes red kitchen, Kinect", "redkitchen"),
    Scene("redkitchen_sparse", "the same, a map of every 100th frame", "redkitchen", mapped=(100, 0), scans=(100, 50)),
    Scene("tum_fr1_rpy", "TUM freiburg1_rpy, hand-held Kinect turned quickly", "tum_fr1_rpy", layout="tum",
          reading=("--clock-offset", TUM_CLOCK), depth_scale=5000.0, last=361),
    Scene("tabletop", "table top, RealSense at 0.2 to 1.9 m", "realsense_tabletop", mapped=(4, 3), scans=(4, 1),
          last=114, map_options=TABLETOP, cloud_cell=0.02),
    Scene("sun3d", "SUN3D, 5 frames", "sun3d_nvblox5/seq-01", **{**FIVE, "last": 4}),
    Scene("slambook", "Kinect, 5 frames, poses of a SLAM system", "mini_sequences/slambook2_ch5", layout="list",
          reading=("--intrinsics", "518,519,325.5,253.5"), **FIVE),
    Scene("icl_nuim", "ICL-NUIM living room, 5 frames without noise", "mini_sequences/slambook2_ch12_iclnuim",
          layout="list", reading=("--intrinsics", "481.2,-480,319.5,239.5"), depth_scale=5000.0, **FIVE),
    Scene("open3d", "Open3D's sample, 5 frames", "mini_sequences/open3d_rgbd5", layout="log", **FIVE),
    simulated("room", "simulated room, Kinect noise", "--scene", "room", "--sensor", "kinect", *SMALL_CAMERA, frames=200),
    simulated("apartment", "simulated flat, Kinect noise", "--sensor", "kinect"),
    simulated("apartment_2", "the same, other noise, sparse map", "--sensor", "kinect", "--noise-seed", 2,
              mapped=(40, 0), scans=(40, 20)),
    simulated("apartment_realsense", "the same, RealSense noise", "--sensor", "realsense", "--noise-seed", 3),
    # Poses as a mapping run would record them; scans are compared with the exact ones.
    simulated("apartment_noise", "simulated flat, a map of sparse frames whose poses err by 1 cm", "--sensor", "kinect", "--pose-noise",
              0.01, "--pose-angle-noise", 0.006, "--pose-noise-seed", 1, mapped=(30, 0), scans=(30, 15)),
    simulated("apartment_drift", "the same, poses that wander by 2 cm", "--sensor", "kinect", "--noise-seed", 5, "--pose-noise",
              0.02, "--pose-angle-noise", 0.012, "--pose-noise-correlation", 6, "--pose-noise-seed", 2, mapped=(10, 0),
              scans=(10, 5)),
    simulated("building", "simulated building of two storeys", "--scene", "building", "--sensor", "kinect", frames=600,
              mapped=(4, 0), scans=(4, 2), map_options=("--voxel-size", "0.05", "--truncation", "0.15")),
)


# What --quick takes: those whose frames are there at once, and a small simulated room.
QUICK = ("redkitchen", "tum_fr1_rpy", "tabletop", "sun3d", "slambook", "icl_nuim", "open3d", "room")


def linked_intrinsics(folder):
    """3DMatch keeps the intrinsics beside its sequences."""
    names = ("camera-intrinsics.txt", "intrinsics.K.txt")
    return not any((folder / name).exists() for name in names) and (folder.parent / names[0]).exists()


def frames_of(scene, data):
    """(step or None, folder of the frames as an argument of a command)."""
    if scene.simulated:
        step = Step(f"{scene.name}/frames", ["ttsdf_simulate", "--output", OUT + "/frames", *scene.simulation],
                    ("simulate",), makes="frames")
        return step, (step, "/frames")
    source = pathlib.Path(data) / scene.source
    if scene.layout != "frames":
        step = Step(f"{scene.name}/frames", ["@frames_from", scene.layout, source, "--output", OUT + "/frames",
                                             *scene.reading], makes="frames")
        return step, (step, "/frames")
    if linked_intrinsics(source):
        step = Step(f"{scene.name}/frames", ["@frames_from", "3dmatch", source, "--output", OUT + "/frames"], makes="frames")
        return step, (step, "/frames")
    return None, source


def with_gravity(scene, data):
    if scene.simulated:
        return scene
    path = pathlib.Path(data) / scene.source / GRAVITY_FILE
    if not path.exists():
        return scene
    return replace(scene, down=",".join(path.read_text().split()))


def available(data, names=()):
    """(scenes that are at hand, names of those that are not). `names`: only these."""
    known = [scene.name for scene in SCENES]
    for name in names:
        if name not in known:
            raise SceneError(f"--scenes: got '{name}', wanted some of {', '.join(known)}")
    chosen = [scene for scene in SCENES if not names or scene.name in names]
    there = [s for s in chosen if s.simulated or (data and (pathlib.Path(data) / s.source).is_dir())]
    return [with_gravity(s, data) for s in there], [s.name for s in chosen if s not in there]


def own_scene(path):
    """A user's folder of frames in the 7-Scenes layout: every 10th frame is mapped, scans lie half-way between."""
    path = pathlib.Path(path)
    indices = sorted(int(m.group(1)) for m in (re.fullmatch(r"frame-(\d+)\.depth\.(png|pgm)", f.name)
                                               for f in path.iterdir()) if m) if path.is_dir() else []
    if len(indices) < 4:
        raise SceneError(f"--frames: got '{path}' with {len(indices)} depth frames, wanted a folder with at least 4 "
                         "frame-NNNNNN.depth.png and poses")
    every = 10 if len(indices) >= 60 else 2
    return with_gravity(Scene(path.resolve().name, "your frames", str(path.resolve()), mapped=(every, 0),
                              scans=(every, every // 2), last=indices[-1] + 1), "/")
