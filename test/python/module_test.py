"""The module `ttsdf` against the C++ tools. usage: module_test.py FOLDER-OF-THE-MODULE FOLDER-OF-THE-TOOLS"""

import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

MODULE_DIR, TOOL_DIR = sys.argv[1:3]
sys.path.insert(0, MODULE_DIR)
import ttsdf  # noqa: E402

HALF = np.array([1.0, 0.75, 0.5])
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], dtype=np.int32)


def box_vertices(centre=(0.0, 0.0, 0.0)):
    corners = np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)])
    return (2.0 * corners - 1.0) * HALF + np.asarray(centre)


def box_distance(points):
    q = np.abs(points) - HALF
    return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)


def surface_points(count, seed=1):
    random = np.random.default_rng(seed)
    points = random.uniform(-1.0, 1.0, (count, 3)) * HALF
    axis = random.integers(0, 3, count)
    side = random.choice([-1.0, 1.0], count)
    points[np.arange(count), axis] = side * HALF[axis]
    normals = np.zeros((count, 3))
    normals[np.arange(count), axis] = side
    return points, normals


class Module(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.box = ttsdf.build_mesh(box_vertices(), FACES, voxel_size=0.05, truncation=0.15, max_rank="40")

    def test_query_is_that_of_the_tool_bit_for_bit(self):
        points = np.random.default_rng(2).uniform(-1.3, 1.3, (500, 3))
        with tempfile.TemporaryDirectory() as folder:
            self.box.save(folder + "/box.ttsdf")
            np.savetxt(folder + "/points.txt", points, fmt="%.17g")
            text = subprocess.run([TOOL_DIR + "/ttsdf_query", folder + "/box.ttsdf", "--points", folder + "/points.txt"],
                                  check=True, stdout=subprocess.PIPE).stdout.decode()
            again = ttsdf.load(folder + "/box.ttsdf")
        values, gradients, valid = again.query(points)  # not yet registered in: that rounds what it keeps decoded
        self.assertEqual(values.dtype, np.float32)
        self.assertEqual(gradients.shape, (500, 3))
        rows = np.array([[float(word) for word in line.split()] for line in text.splitlines()])
        np.testing.assert_array_equal(rows[:, 0].astype(np.float32), values)
        np.testing.assert_array_equal(rows[:, 1:4].astype(np.float32), gradients)
        np.testing.assert_array_equal(rows[:, 4] > 0, valid)
        self.assertEqual(again.info["map_id"], self.box.info["map_id"])

    def test_distances_are_those_of_the_box(self):
        points = np.random.default_rng(3).uniform(-1.15, 1.15, (2000, 3)) * HALF
        values, _, valid = self.box.query(points)
        truth = box_distance(points)
        near = valid & (np.abs(truth) < 0.05)
        self.assertGreater(near.sum(), 100)
        self.assertLess(np.sqrt(np.mean((values[near] - truth[near]) ** 2)), 0.01)

    def test_results_are_not_copied(self):
        _, gradients, _ = self.box.query(np.zeros((10, 3)))
        self.assertFalse(gradients.flags.owndata)
        vertices, triangles = self.box.surface()
        self.assertFalse(vertices.flags.owndata)
        self.assertLess(np.abs(box_distance(vertices)).max(), 0.025)
        self.assertLess(triangles.max(), len(vertices))

    def test_clouds_and_far_places(self):
        points, normals = surface_points(20000)
        utm = np.array([356789.0, 5412345.0, 122.0])
        cloud = ttsdf.build_cloud(points + utm, normals, voxel_size=0.05, truncation=0.15)
        probes, outward = surface_points(500, seed=7)
        inner = np.sort(np.abs(probes) / HALF, axis=1)[:, 1] < 0.85  # away from edges, which a cloud rounds
        values, gradients, valid = cloud.query(probes + utm)
        self.assertGreater(valid.mean(), 0.99)
        self.assertLess(np.sqrt(np.mean(values[inner & valid] ** 2)), 0.01)
        self.assertGreater(np.median(np.sum(gradients * outward, axis=1)[inner & valid]), 0.9)
        estimated = ttsdf.build_cloud(points, seen_from_inside=False, voxel_size=0.05, truncation=0.15)
        _, gradients, valid = estimated.query(probes)
        self.assertGreater(np.median(np.sum(gradients * outward, axis=1)[inner & valid]), 0.9)

    def test_registration_finds_the_pose(self):
        points, normals = surface_points(3000)
        keep = (points @ np.array([0.3, 0.5, 0.8])) > -0.4  # no symmetry
        points = points[keep]
        T = np.eye(4)
        angle = 0.3
        T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        T[:3, 3] = [0.2, -0.1, 0.05]
        scan = (points - T[:3, 3]) @ T[:3, :3]
        prior = T.copy()
        prior[:3, 3] += [0.03, -0.02, 0.02]
        registration = self.box.registration(check_facing=False)
        for result in (registration.track(scan, prior), registration.search(scan, prior)):
            self.assertTrue(result.success, result)
            self.assertLess(np.linalg.norm(result.pose[:3, 3] - T[:3, 3]), 0.01)
            self.assertEqual(result.covariance.shape, (6, 6))

    def test_frames_from_numpy(self):
        height, width, f = 60, 80, 60.0
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        depths, poses = [], []
        for x in np.linspace(-0.2, 0.2, 5):  # a wall at z = 2
            T = np.eye(4)
            T[0, 3] = x
            poses.append(T)
            depths.append(np.full((height, width), 2000, dtype=np.uint16))
        wall = ttsdf.build_frames(depths, poses, [f, f, width / 2 - 0.5, height / 2 - 0.5], voxel_size=0.05, truncation=0.15)
        values, _, valid = wall.query([[0.0, 0.0, 1.95], [0.1, 0.1, 2.0]])
        self.assertTrue(valid.all())
        np.testing.assert_allclose(values, [0.05, 0.0], atol=0.005)
        self.assertEqual(u.shape, v.shape)

    def test_errors_are_value_errors_with_words(self):
        for call, words in ((lambda: ttsdf.load("/nowhere/a.ttsdf"), "/nowhere/a.ttsdf"),
                            (lambda: self.box.query(np.zeros(3)), "(n, 3)"),
                            (lambda: ttsdf.build_mesh(box_vertices(), FACES, voxels=1), "voxels"),
                            (lambda: ttsdf.build_mesh(box_vertices(), FACES, voxel_size=-1), "voxel_size"),
                            (lambda: ttsdf.build_mesh(box_vertices(), FACES + 1), "indices"),
                            (lambda: ttsdf.build_cloud(np.zeros((3, 3))), "at least 50"),
                            (lambda: self.box.registration(min_points="many"), "min_points"),
                            (lambda: self.box.registration().track(np.zeros((5, 3)), np.zeros((4, 4))), "rotation")):
            with self.assertRaises(ValueError) as caught:
                call()
            self.assertIn(words, str(caught.exception))

    def test_occupancy(self):
        grid = self.box.occupancy(min_height=-0.2, max_height=0.2)
        cells = grid["cells"]
        column, row = ((np.array([1.0, 0.3]) - grid["origin"][:2]) / grid["resolution"]).astype(int)
        self.assertEqual(cells[row, column], 100)
        self.assertEqual(set(np.unique(cells)) - {-1, 0, 100}, set())


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    unittest.main(argv=[sys.argv[0]], verbosity=1)
