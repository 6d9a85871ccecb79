"""Depth frames of a furnished box room, rendered with numpy: written as a frames folder for tests of the whole chain.
Independent of the C++ simulation on purpose."""

import os
import sys

import numpy as np
from PIL import Image

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts"))
import poses  # noqa: E402

ROOM = (np.array([0.0, 0.0, 0.0]), np.array([4.0, 3.0, 2.5]))
BOXES = [(np.array([0.0, 0.0, 0.0]), np.array([0.6, 1.2, 1.8])),    # wardrobe
         (np.array([2.6, 2.2, 0.0]), np.array([4.0, 3.0, 0.5])),    # bed
         (np.array([3.4, 0.0, 0.0]), np.array([4.0, 0.7, 0.9])),    # chest
         (np.array([1.2, 2.6, 0.7]), np.array([2.0, 3.0, 1.1])),    # shelf
         (np.array([1.8, 0.0, 1.2]), np.array([2.6, 0.25, 1.6]))]   # cupboard
WIDTH, HEIGHT, FOCAL = 160, 120, 140.0
K = np.array([[FOCAL, 0.0, (WIDTH - 1) / 2.0], [0.0, FOCAL, (HEIGHT - 1) / 2.0], [0.0, 0.0, 1.0]])


def slabs(origin, directions, box):
    """Entry and exit distance of every ray through an axis-parallel box."""
    with np.errstate(divide="ignore"):
        a = (box[0] - origin) / directions
        b = (box[1] - origin) / directions
    return np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)


def render(T_map_camera):
    """Depth along the optical axis [m]."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - K[0, 2]) / FOCAL, (v - K[1, 2]) / FOCAL, np.ones_like(u, dtype=float)], axis=-1)
    directions = rays @ T_map_camera[:3, :3].T
    directions[directions == 0.0] = 1e-12
    origin = T_map_camera[:3, 3]
    depth = slabs(origin, directions, ROOM)[1]
    for box in BOXES:
        entry, leave = slabs(origin, directions, box)
        hit = (entry < leave) & (entry > 0.0)
        depth = np.where(hit & (entry < depth), entry, depth)
    return depth


def camera_poses(count):
    """T_map_camera on a loop around the middle of the room, looking outwards, with some pitch and roll."""
    optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    result = []
    for n in range(count):
        phase = 2.0 * np.pi * n / count
        yaw = phase + 0.3 * np.sin(2.0 * phase)
        rotation = (poses.exp_so3([0.0, 0.0, yaw]) @ poses.exp_so3([0.0, 0.15 + 0.1 * np.sin(3.0 * phase), 0.0])
                    @ poses.exp_so3([0.05 * np.sin(2.0 * phase), 0.0, 0.0]))
        position = [1.9 + 0.45 * np.cos(phase), 1.5 + 0.35 * np.sin(phase), 1.25 + 0.08 * np.sin(2.0 * phase)]
        result.append(poses.pose(rotation @ optical, position))
    return result


def write_folder(path, count):
    np.savetxt(os.path.join(path, "camera-intrinsics.txt"), K)
    for index, T in enumerate(camera_poses(count)):
        stem = os.path.join(path, "frame-%06d" % index)
        millimetres = np.round(1000.0 * render(T)).astype(np.uint16)
        Image.fromarray(millimetres).save(stem + ".depth.png")
        np.savetxt(stem + ".pose.txt", T)
