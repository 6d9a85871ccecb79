"""Arguments of the module `ttsdf` as people have them. usage: arguments_test.py FOLDER-OF-THE-MODULE"""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

MODULE_DIR = sys.argv[1]
sys.path.insert(0, MODULE_DIR)
import ttsdf  # noqa: E402

VERTICES = (2.0 * np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)]) - 1.0) * [1.0, 0.75, 0.5]
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])
OPTIONS = {"voxel_size": 0.05, "truncation": 0.15}
K = [60.0, 60.0, 39.5, 29.5]
IMAGE = np.full((60, 80), 2000, dtype=np.uint16)
POINTS = np.random.default_rng(2).uniform(-1.0, 1.0, (300, 3))
POINTS0 = POINTS[0]


def frames(count=3):
    poses = []
    for n in range(count):
        pose = np.eye(4)
        pose[0, 3] = 0.05 * n
        poses.append(pose)
    return [IMAGE] * count, poses


def layouts(array):
    """The same numbers in every layout that numpy has for them."""
    wide = np.zeros((2 * array.shape[0], array.shape[1] + 1), dtype=array.dtype)
    wide[::2, 1:] = array
    read_only = array.copy()
    read_only.flags.writeable = False
    return {"as is": array, "Fortran": np.asfortranarray(array), "strided": wide[::2, 1:],
            "backwards": array[::-1].copy()[::-1], "big-endian": array.astype(array.dtype.newbyteorder(">")),
            "read only": read_only, "lists": array.tolist()}


def processor_seconds(program):
    fields = pathlib.Path("/proc/%d/stat" % program.pid).read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


# Repeats a call until it is interrupted. Nothing of Python runs between the end of a call and the byte that says so; the
# signal's own byte comes before it if the call went on.
INTERRUPTED = """
import functools, itertools, os, signal, sys
sys.path.insert(0, %r)
import numpy as np, ttsdf

corners = (2.0 * np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)]) - 1.0) * 3
faces = np.array(%r)
coarse = functools.partial(ttsdf.build_mesh, corners, faces, voxel_size=0.05, truncation=0.15)

%s

signal.signal(signal.SIGINT, signal.default_int_handler)  # programs in the background ignore it
reading, writing = os.pipe()
os.set_blocking(writing, False)
signal.set_wakeup_fd(writing)
ends = map(os.write, itertools.repeat(writing), itertools.repeat(b"."))
print("ready", flush=True)
try:
    for _ in zip(iter(work, None), ends):
        pass
except KeyboardInterrupt:
    after = os.read(reading, 1 << 16).partition(bytes([signal.SIGINT]))[2]
    print(after.count(b"."), "calls ended after the signal")
    raise
"""

# Calls of a second and more: signals are looked at every 0.1 s.
INTERRUPTIBLE = {
    "mesh": """
work = functools.partial(ttsdf.build_mesh, corners, faces, voxel_size=0.012, truncation=0.15)
""",
    "cloud": """
points = np.random.default_rng(1).uniform(-1, 1, (2000000, 3))
points[np.arange(2000000), np.arange(2000000) % 3] = 1.0
work = functools.partial(ttsdf.build_cloud, points * 4, voxel_size=0.015, truncation=0.03)
""",
    "frames": """
image = np.full((60, 80), 2000, np.uint16)
work = functools.partial(ttsdf.build_frames, itertools.repeat(image), itertools.repeat(np.eye(4)), [60, 60, 40, 30],
                         voxel_size=0.05, truncation=0.15)
""",
    "search": """
box = coarse()
registration = box.registration(starts_without_gravity=300000, starts=300000)
work = functools.partial(registration.globally, box.surface()[0])
""",
    "queries": """
points = np.random.default_rng(1).uniform(-3, 3, (8000000, 3))
points[np.arange(len(points)), np.arange(len(points)) % 3] = 3.0
work = functools.partial(coarse().query, points)
""",
}


class Arguments(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.box = ttsdf.build_mesh(VERTICES, FACES, **OPTIONS)

    def refused(self, words, call, *arguments, **keywords):
        with self.assertRaises(ValueError) as caught:
            call(*arguments, **keywords)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, str(caught.exception))

    def test_every_layout_gives_the_same(self):
        values, gradients, valid = self.box.query(POINTS)
        for name, points in layouts(POINTS).items():
            again = self.box.query(points)
            np.testing.assert_array_equal(again[0], values, name)
            np.testing.assert_array_equal(again[1], gradients, name)
            np.testing.assert_array_equal(again[2], valid, name)
        for name, faces in layouts(FACES).items():
            for kind in ("i2", "u1", "i8", "u8") if name == "as is" else ("",):
                given = faces.astype(kind) if kind else faces
                self.assertEqual(ttsdf.build_mesh(VERTICES, given, **OPTIONS).info["map_id"], self.box.info["map_id"], name)
        for name, vertices in layouts(VERTICES).items():
            self.assertEqual(ttsdf.build_mesh(vertices, FACES, **OPTIONS).info["map_id"], self.box.info["map_id"], name)

    def test_every_layout_of_a_depth_image_gives_the_same(self):
        _, poses = frames()
        ramp = (2000 + np.arange(60)[:, None] + np.arange(80)[None, :]).astype(np.uint16)
        wanted = ttsdf.build_frames([ramp] * 3, poses, K, **OPTIONS).info["map_id"]
        for name, image in layouts(ramp).items():
            self.assertEqual(ttsdf.build_frames([image] * 3, np.array(poses), K, **OPTIONS).info["map_id"], wanted, name)
        for kind in ("i4", "u8", "i8"):
            self.assertEqual(ttsdf.build_frames([ramp.astype(kind)] * 3, poses, K, **OPTIONS).info["map_id"], wanted, kind)
        metres = (ramp / np.float32(1000.0)).astype(np.float32)
        for name, image in layouts(metres).items():
            again = ttsdf.build_frames([image] * 3, poses, K, **OPTIONS)
            self.assertEqual(again.info["map_id"], wanted, name)
        half = ttsdf.build_frames([np.full((60, 80), 2.0, np.float16)] * 3, poses, K, **OPTIONS)
        self.assertTrue(half.query([[0.0, 0.0, 2.0]])[2].all())
        holes = metres.copy()
        holes[:5], holes[5:10], holes[10:15], holes[15:20] = np.nan, np.inf, -1.0, 0.0
        self.assertTrue(ttsdf.build_frames([holes] * 3, poses, K, **OPTIONS).query([[0.0, 0.0, 2.07]])[2].all())

    def test_indices_are_not_cast(self):
        for kind in ("f4", "f8", "f2"):
            self.refused(["triangles", "integers"], ttsdf.build_mesh, VERTICES, FACES.astype(kind), **OPTIONS)
        self.refused("integers", ttsdf.build_mesh, VERTICES, FACES + 0.4, **OPTIONS)
        for shift in (-1, 2**32, -2**32, 2**31, 1):  # 2^32 is 0 in an int
            self.refused(["indices"], ttsdf.build_mesh, VERTICES, FACES + shift, **OPTIONS)
        self.refused("indices", ttsdf.build_mesh, VERTICES, FACES.astype(np.uint64) + np.uint64(2**63), **OPTIONS)
        self.refused("triangle", ttsdf.build_mesh, VERTICES, np.zeros((0, 3), int), **OPTIONS)

    def test_what_is_no_array_of_numbers_is_refused(self):
        for values in (POINTS.astype(complex), POINTS.astype(str), POINTS.astype(object), POINTS > 0, "points", None,
                       np.ma.masked_array(POINTS, POINTS > 0.5), {"x": 1}, [[1, 2, 3], [1, 2]], POINTS.T, POINTS0, 5.0,
                       np.zeros((2, 2, 3)), np.zeros(3, dtype=[("x", "f4")])):
            self.refused("points", self.box.query, values)
            self.refused("points", ttsdf.build_cloud, values)
            self.refused("points", self.box.registration().track, values, np.eye(4))
            self.refused("prior", self.box.registration().track, POINTS, values)
            if values is not POINTS0:
                self.refused("gravity", self.box.registration().globally, POINTS, gravity=values if values is not None else "z")
                self.refused("viewpoint", ttsdf.build_cloud, POINTS, viewpoint=values if values is not None else "none")
            self.refused("vertices", ttsdf.build_mesh, values, FACES)
            self.refused("triangles", ttsdf.build_mesh, VERTICES, values)
            self.refused("normals", ttsdf.build_cloud, POINTS, values if values is not None else "none")
            self.refused("intrinsics", ttsdf.build_frames, *frames(), values)
            if values is not None and not isinstance(values, (float, dict, str)):
                self.refused("depth image", ttsdf.build_frames, [values[0]], frames(1)[1], K)
                self.refused("pose", ttsdf.build_frames, [IMAGE], [values], K)

    def test_errors_of_the_conversion_are_told(self):
        class Array:
            def __init__(self, error):
                self.error = error

            def __array__(self, *_, **__):
                raise self.error

        device = "can't convert cuda:0 device type tensor to numpy. Use Tensor.cpu() first."
        for error in (TypeError(device), ValueError("ünfinished")):
            self.refused(["points", "Array", "wanted an array of numbers", str(error)], self.box.query, Array(error))
            self.refused(["vertices", str(error)], ttsdf.build_mesh, Array(error), FACES)
            self.refused(["frame 1", "depth image", str(error)], ttsdf.build_frames, [IMAGE, Array(error)], frames(2)[1], K)
        for error in (RuntimeError("requires grad"), SystemExit(3), KeyboardInterrupt(), MemoryError(), OSError("disk"), KeyError("x")):
            for call in (lambda: self.box.query(Array(error)), lambda: ttsdf.build_frames([Array(error)], frames(1)[1], K)):
                with self.assertRaises(type(error)) as caught:
                    call()
                self.assertIs(caught.exception, error)

    def test_nothing_and_no_number(self):
        values, gradients, valid = self.box.query(np.zeros((0, 3)))
        self.assertEqual((values.shape, gradients.shape, valid.shape), ((0,), (0, 3), (0,)))
        nothing = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [0, 0, -np.inf], [3e38, 0, 0], [1e30, 0, 0]])
        self.assertFalse(self.box.query(nothing)[2].any())
        self.assertFalse(self.box.registration().track(nothing, np.eye(4)).success)
        self.assertFalse(self.box.registration().track(np.zeros((0, 3)), np.eye(4)).success)
        self.assertFalse(self.box.registration().globally(nothing).success)
        self.refused("vertices", ttsdf.build_mesh, np.zeros((0, 3)), FACES)
        self.refused("vertices", ttsdf.build_mesh, np.where(VERTICES > 0.9, np.nan, VERTICES), FACES)
        self.refused("mesh", ttsdf.build_mesh, VERTICES * 1e300, FACES)
        self.refused("cloud", ttsdf.build_cloud, np.zeros((0, 3)))
        self.refused("cloud", ttsdf.build_cloud, np.full((100, 3), np.nan))
        self.refused(["normals", "5", "300"], ttsdf.build_cloud, POINTS, np.ones((5, 3)))
        self.refused("viewpoint", ttsdf.build_cloud, POINTS, viewpoint=[0, 0, np.nan])
        self.refused("gravity", self.box.registration().globally, POINTS, gravity=[0, 0, 0])
        self.refused("map_down", self.box.registration().globally, POINTS, map_down=[0, np.nan, 0])

    def test_frames_and_poses_are_counted(self):
        images, poses = frames(5)
        for count in (3, 4):
            for kind in (list, iter):
                self.refused(["poses", str(count), "depth images"], ttsdf.build_frames, kind(images), kind(poses[:count]), K, **OPTIONS)
                self.refused(["poses", str(count), "depth images"], ttsdf.build_frames, kind(images[:count]), kind(poses), K, **OPTIONS)
        self.refused("depth image", ttsdf.build_frames, [], [], K, **OPTIONS)
        self.refused(["frame 1", "depth image"], ttsdf.build_frames, [IMAGE, np.zeros((0, 5), np.uint16)], poses[:2], K)
        self.refused(["frame 1", "pose"], ttsdf.build_frames, images[:2], [poses[0], -poses[1]], K)
        self.refused(["frame 1", "pose"], ttsdf.build_frames, images[:2], [poses[0], np.full((4, 4), np.nan)], K)
        self.refused(["metres"], ttsdf.build_frames, [image.astype(np.float32) for image in images], poses, K)
        for scale in (0, -1, np.nan, np.inf):
            self.refused("depth_scale", ttsdf.build_frames, images, poses, K, depth_scale=scale)

        def broken():
            yield images[0]
            raise KeyError("mine")
        with self.assertRaises(KeyError):
            ttsdf.build_frames(broken(), poses, K)

    def test_intrinsics_are_those_of_a_camera(self):
        images, poses = frames()
        matrix = np.array([[60.0, 0, 39.5], [0, 60.0, 29.5], [0, 0, 1]])
        wanted = ttsdf.build_frames(images, poses, K, **OPTIONS).info["map_id"]
        whole = np.eye(4)
        whole[:3, :3] = matrix
        for good in (matrix, whole, whole[:3], matrix.tolist(), np.asfortranarray(matrix)):
            self.assertEqual(ttsdf.build_frames(images, poses, good, **OPTIONS).info["map_id"], wanted)
        skewed = matrix.copy()
        skewed[0, 1] = 5.0
        for bad in (matrix.T, 2.0 * matrix, skewed, np.zeros((5, 7)), np.zeros((3, 3)), K[:3], [], [0, 0, 0, 0],
                    [np.nan, 60, 40, 30]):
            self.refused("intrinsics", ttsdf.build_frames, images, poses, bad, **OPTIONS)

    def test_paths_of_every_kind(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "box.ttsdf"
            self.box.save(path)
            strange = os.fsencode(folder) + b"/b\xff.ttsdf"
            self.box.save(strange)
            self.box.save(os.fsdecode(strange))
            for given in (path, str(path), bytes(path), strange, os.fsdecode(strange)):
                self.assertEqual(ttsdf.load(given).info["map_id"], self.box.info["map_id"])
            cloud = pathlib.Path(folder) / "points.xyz"
            np.savetxt(cloud, POINTS)
            np.testing.assert_allclose(ttsdf.read_points(cloud), POINTS)
            mesh = pathlib.Path(folder) / "box.off"
            mesh.write_text("OFF\n8 12 0\n" + "\n".join("%r %r %r" % tuple(v) for v in VERTICES.tolist()) + "\n" +
                            "\n".join("3 %d %d %d" % tuple(f) for f in FACES) + "\n")
            self.assertEqual(ttsdf.read_mesh(mesh)[1].shape, (12, 3))
            self.refused("null byte", ttsdf.load, str(path) + "\0x")
            (pathlib.Path(folder) / "short.ttsdf").write_bytes(path.read_bytes()[:200])
            self.refused("short.ttsdf", ttsdf.load, pathlib.Path(folder) / "short.ttsdf")
            self.refused(folder, ttsdf.load, folder)
            self.refused("nowhere", self.box.save, pathlib.Path(folder) / "nowhere" / "box.ttsdf")
        for no_path in (5, None, 1.5, ["a"]):
            with self.assertRaises(TypeError):
                ttsdf.load(no_path)

    def test_options_of_numpy(self):
        given = {"voxel_size": np.float64(0.05), "truncation": np.float64(0.15), "threads": np.int64(2), "max_rank": np.int32(40),
                 "support_mask": np.bool_(True)}
        self.assertEqual(ttsdf.build_mesh(VERTICES, FACES, **given).info["map_id"], self.box.info["map_id"])
        for name, value in (("voxel_size", None), ("voxel_size", [0.05]), ("voxel_size", np.nan), ("voxel_size", 1e300),
                            ("threads", 2.5), ("threads", 10**30), ("support_mask", "perhaps"), ("max_rank", -1), ("max_rank", (1, 2, 3))):
            self.refused(name, ttsdf.build_mesh, VERTICES, FACES, **dict(OPTIONS, **{name: value}))

    def test_occupancy_of_nonsense(self):
        for keywords in ({"resolution": -1}, {"resolution": np.nan}, {"resolution": 1e-9}, {"min_height": np.nan}, {"max_height": -5}):
            self.refused("occupancy", self.box.occupancy, **keywords)

    def test_threads_may_share_a_registration(self):
        registration = self.box.registration(check_facing=False)
        surface = self.box.surface()[0]
        results = []

        def run():
            for _ in range(5):
                results.append(registration.track(surface, np.eye(4)).pose)
        threads = [threading.Thread(target=run) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(results), 20)
        for pose in results:
            np.testing.assert_array_equal(pose, results[0])

    def interrupted(self, work):
        """Ctrl-C in the middle of the call `work`. Returns the calls that ended by themselves after it, and the seconds this took."""
        program = subprocess.Popen([sys.executable, "-c", INTERRUPTED % (MODULE_DIR, FACES.tolist(), work)],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            self.assertEqual(program.stdout.readline(), b"ready\n")
            until = processor_seconds(program) + 0.1  # into the work, however busy the machine is
            while processor_seconds(program) < until:
                self.assertIsNone(program.poll())
                time.sleep(0.01)
            begin = time.monotonic()
            program.send_signal(signal.SIGINT)
            out, error = program.communicate(timeout=600)  # of work that never ends
            self.assertIn(b"KeyboardInterrupt", error)
            return int(out.split()[0]), time.monotonic() - begin
        finally:
            program.kill()
            program.wait()

    def test_keyboard_interrupts(self):
        for name, work in INTERRUPTIBLE.items():
            with self.subTest(name):
                for _ in range(3):  # in the last 0.1 s of a call the signal may come too late for it
                    ended, seconds = self.interrupted(work)
                    if ended == 0:
                        break
                self.assertEqual(ended, 0, "calls ended after the signal")
                print("interrupted", name, "after %.1f s" % seconds)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]] + sys.argv[2:], verbosity=1)
