"""Rigid motions as 4x4 numpy arrays. T_a_b maps coordinates of frame b to frame a; quaternions are x, y, z, w."""

import numpy as np


def pose(rotation=None, translation=(0.0, 0.0, 0.0)):
    T = np.eye(4)
    if rotation is not None:
        T[:3, :3] = rotation
    T[:3, 3] = translation
    return T


def inverse(T):
    R_transposed = T[:3, :3].T
    return pose(R_transposed, -R_transposed @ T[:3, 3])


def exp_so3(w):
    """Rotation vector [rad] -> rotation matrix (Rodrigues)."""
    w = np.asarray(w, dtype=float)
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = w / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def rotation_angle(R):
    """Angle of a rotation matrix [rad], exact near 0 and near pi."""
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.arctan2(np.linalg.norm(axis), np.trace(R) - 1.0))


def orthonormalized(matrix, tolerance=0.05):
    """Nearest rigid motion to a 4x4 matrix; ValueError if it is not finite or far from a rotation."""
    matrix = np.asarray(matrix, dtype=float)
    if matrix.shape != (4, 4) or not np.all(np.isfinite(matrix)):
        raise ValueError("got a matrix that is not 4x4 and finite, wanted a pose")
    R = matrix[:3, :3]
    U, _, Vt = np.linalg.svd(R)
    if np.abs(R @ R.T - np.eye(3)).max() > tolerance or np.linalg.det(R) < 0.0:
        raise ValueError("got a block that is no rotation (determinant %.3f), wanted one" % np.linalg.det(R))
    return pose(U @ Vt, matrix[:3, 3])


def quaternion_from_rotation(R):
    """x, y, z, w with w >= 0; picks the largest component first, so it is exact everywhere."""
    candidates = np.array([R[0, 0], R[1, 1], R[2, 2], np.trace(R)])
    largest = int(np.argmax(candidates))
    q = np.empty(4)
    if largest == 3:
        q[3] = 1.0 + candidates[3]
        q[:3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q[i] = 1.0 + R[i, i] - R[j, j] - R[k, k]
        q[j] = R[j, i] + R[i, j]
        q[k] = R[k, i] + R[i, k]
        q[3] = R[k, j] - R[j, k]
    q /= np.linalg.norm(q)
    return -q if q[3] < 0.0 else q


def rotation_from_quaternion(q):
    x, y, z, w = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
