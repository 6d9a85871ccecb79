"""The analytic room of test/support/room.h once more, in numpy: an oracle of its own for the tests with real nodes."""

import numpy as np

SIZE = np.array([6.0, 5.0, 3.0])


def distance(p):
    """Signed distance [m] of points p (n x 3), positive in free space."""
    walls = np.minimum(p.min(axis=1), (SIZE - p).min(axis=1))

    def box(centre, half):
        q = np.abs(p - centre) - half
        return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)

    cupboard = box(np.array([0.4, 3.2, 1.0]), np.array([0.4, 0.9, 1.0]))
    table = box(np.array([4.2, 1.2, 0.4]), np.array([0.8, 0.5, 0.4]))
    ball = np.linalg.norm(p - np.array([4.6, 4.2, 1.4]), axis=1) - 0.45
    return np.minimum.reduce([walls, cupboard, table, ball])


def rotation(yaw, pitch=0.0, roll=0.0):
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return rz @ ry @ rx


def pose(x, y, z, yaw, pitch=0.0, roll=0.0):
    """4 x 4 pose of a frame with x forward and z up."""
    T = np.eye(4)
    T[:3, :3] = rotation(yaw, pitch, roll)
    T[:3, 3] = [x, y, z]
    return T


# Camera frame (z forward, x right, y down) in the base frame, 1.2 m above the floor and tilted down a little.
T_BASE_CAMERA = np.eye(4)
T_BASE_CAMERA[:3, :3] = rotation(0.0, 0.1) @ np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
T_BASE_CAMERA[:3, 3] = [0.15, 0.0, 1.2]


FOCAL = 0.866  # of the camera, in widths of its image


def scan(T_map_camera, width=64, height=48):
    """Points of a pinhole camera of 60 x 47 degrees in the camera frame, float32, height x width x 3."""
    focal = FOCAL * width
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([(u - 0.5 * (width - 1)) / focal, (v - 0.5 * (height - 1)) / focal, np.ones(u.shape)], axis=-1)
    rays = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)
    directions = rays @ T_map_camera[:3, :3].T
    ranges = np.zeros(len(rays))
    going = np.arange(len(rays))
    for _ in range(200):  # sphere tracing
        step = distance(T_map_camera[:3, 3] + ranges[going, None] * directions[going])
        ranges[going] += step
        going = going[step > 1e-5]
    return (rays * ranges[:, None]).astype(np.float32).reshape(height, width, 3)
