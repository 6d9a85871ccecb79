"""A point cloud map in as few bytes as a map of ours: averaged per cell, compressed by Draco, and decoded again.

usage: scripts/results small_cloud --frames FOLDER --bytes-of FILE --output FOLDER [--depth-scale N] [--map-every N]
                                   [--map-offset M]

Writes cloud.ply (as decoded), and cloud.drc: the finest cloud whose file is not larger than FILE. Needs the Debian
package draco.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys

import numpy as np

from depth_frames import FrameError, FrameFolder

POSITION_BITS = 12   # of a coordinate: a millimetre or two in a room
FINEST, COARSEST = 0.01, 0.5  # cells [m]


def points_of(depth, K, scale, stride=2, nearest=0.2, farthest=4.0):
    rows, columns = np.mgrid[0:depth.shape[0]:stride, 0:depth.shape[1]:stride]
    z = depth[rows, columns] / scale
    seen = (z >= nearest) & (z <= farthest)
    return np.stack(((columns - K[0, 2]) / K[0, 0] * z, (rows - K[1, 2]) / K[1, 1] * z, z), axis=-1)[seen]


def averaged(points, cell):
    """One point per cell: the mean of those in it."""
    keys = np.floor(points / cell).astype(np.int64)
    keys -= keys.min(axis=0)
    sizes = keys.max(axis=0) + 1
    flat = (keys[:, 0] * sizes[1] + keys[:, 1]) * sizes[2] + keys[:, 2]
    _, inverse, counts = np.unique(flat, return_inverse=True, return_counts=True)
    return np.stack([np.bincount(inverse, points[:, axis]) / counts for axis in range(3)], axis=1)


def map_points(folder, every, offset, scale):
    parts = []
    for index in folder.select(every, offset):
        T = folder.pose(index)
        parts.append(averaged(points_of(folder.depth(index), folder.K, scale) @ T[:3, :3].T + T[:3, 3], FINEST))
    return averaged(np.concatenate(parts), FINEST)


def write_ply(path, points):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + \
           "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    path.write_bytes(head.encode() + points.astype("<f4").tobytes())


def draco(*command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
    if result.returncode != 0:
        raise FrameError(f"{command[0]}: {result.stdout.strip() or result.returncode}")


def encode(points, cell, folder):
    """Bytes of the cloud of this cell size, left in cloud.drc."""
    write_ply(folder / "input.ply", averaged(points, cell))
    draco("draco_encoder", "-point_cloud", "-i", str(folder / "input.ply"), "-o", str(folder / "cloud.drc"), "-qp",
          str(POSITION_BITS), "-cl", "10")
    return (folder / "cloud.drc").stat().st_size


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", required=True)
    parser.add_argument("--bytes-of", required=True, type=pathlib.Path)
    parser.add_argument("--output", required=True, type=pathlib.Path)
    parser.add_argument("--depth-scale", type=float, default=1000.0)
    parser.add_argument("--map-every", type=int, default=10)
    parser.add_argument("--map-offset", type=int, default=0)
    a = parser.parse_args(arguments)
    if not shutil.which("draco_encoder"):
        sys.exit("small_cloud: error: got no draco_encoder, wanted it (package draco)")
    wanted = a.bytes_of.stat().st_size
    points = map_points(FrameFolder(a.frames), a.map_every, a.map_offset, a.depth_scale)
    fine, coarse = FINEST, COARSEST
    while coarse / fine > 1.01:
        middle = (fine * coarse) ** 0.5
        if encode(points, middle, a.output) > wanted:
            fine = middle
        else:
            coarse = middle
    size = encode(points, coarse, a.output)
    draco("draco_decoder", "-i", str(a.output / "cloud.drc"), "-o", str(a.output / "decoded.ply"))
    decoded = read_ply_points(a.output / "decoded.ply")
    write_ply(a.output / "cloud.ply", decoded)
    print(f"{len(decoded)} points of cells of {1e3 * coarse:.0f} mm in {size} bytes (wanted at most {wanted})")
    return 0


def read_ply_points(path):
    """Vertices of a binary PLY file of floats only, as draco_decoder writes it for a cloud."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    words = [line.split() for line in head.decode().splitlines()]
    count = next(int(w[2]) for w in words if w[:2] == ["element", "vertex"])
    properties = [w[2] for w in words if w and w[0] == "property"]
    values = np.frombuffer(body, "<f4", count * len(properties)).reshape(count, -1)
    return values[:, [properties.index(axis) for axis in "xyz"]]
