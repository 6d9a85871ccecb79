"""Reader of depth-frame folders in the 7-Scenes / 3DMatch layout, as ttsdf_build --frames reads them:
frame-NNNNNN.depth.png (16 bit; .pgm too), frame-NNNNNN.pose.txt (4x4 camera-to-world), camera-intrinsics.txt (3x3)."""

import pathlib
import re

import numpy as np
from PIL import Image

from poses import orthonormalized

INTRINSICS_NAMES = ("camera-intrinsics.txt", "intrinsics.K.txt")
NO_READING = 65535  # besides 0


class FrameError(Exception):
    """The folder or one of its files cannot be used; the text names it."""


class FrameFolder:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        if not self.path.is_dir():
            raise FrameError("%s: got no folder, wanted one with depth frames" % path)
        self.indices = self._indices()
        self.K = self._intrinsics()

    def _indices(self):
        """Frames that have a depth image and a pose, rising."""
        depth = {}
        for file in self.path.iterdir():
            match = re.fullmatch(r"frame-(\d+)\.depth\.(png|pgm)", file.name)
            if match:
                depth[int(match.group(1))] = file
        if not depth:
            raise FrameError("%s: got no frame-NNNNNN.depth.png, wanted some" % self.path)
        self._depth = {i: f for i, f in depth.items() if self._pose_path(f).exists()}
        if not self._depth:
            raise FrameError("%s: got %d depth images but no pose files, wanted frame-NNNNNN.pose.txt beside them"
                             % (self.path, len(depth)))
        return sorted(self._depth)

    @staticmethod
    def _pose_path(depth_path):
        return depth_path.with_name(depth_path.name.split(".")[0] + ".pose.txt")

    def _intrinsics(self):
        for name in INTRINSICS_NAMES:
            if (self.path / name).exists():
                K = self._matrix(self.path / name)
                if K.shape != (3, 3) or not (K[0, 0] and K[1, 1]):
                    raise FrameError("%s: got no 3x3 camera matrix" % (self.path / name))
                return K
        raise FrameError("%s: wanted %s" % (self.path, " or ".join(INTRINSICS_NAMES)))

    @staticmethod
    def _matrix(path):
        try:
            return np.loadtxt(path, dtype=float, ndmin=2)
        except ValueError as error:
            raise FrameError("%s: %s" % (path, error)) from error

    def select(self, every, offset):
        return [index for index in self.indices if index % every == offset]

    def pose(self, index):
        """T_map_camera as recorded."""
        return self._read_pose(self._pose_path(self._depth[index]))

    def truth(self, index):
        """T_map_camera without the error that ttsdf_simulate --pose-noise gave the recorded one."""
        path = self._depth[index]
        return self._read_pose(path.with_name(path.name.split(".")[0] + ".truth.txt"))

    def _read_pose(self, path):
        try:
            return orthonormalized(self._matrix(path))
        except ValueError as error:
            raise FrameError("%s: %s" % (path, error)) from error

    def depth(self, index):
        """uint16 depth units, 0 where there is no reading."""
        path = self._depth[index]
        try:
            depth = np.array(Image.open(path))
        except OSError as error:
            raise FrameError("%s: %s" % (path, error)) from error
        if depth.ndim != 2:
            raise FrameError("%s: got %d channels, wanted one of 16 bit" % (path, depth.shape[-1]))
        depth = depth.astype(np.uint16)
        depth[depth == NO_READING] = 0
        return depth
