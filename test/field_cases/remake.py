"""Small files that failed once, each made after the situation of a public bug report: one function per case, which writes
into a folder of the case's name. What is right for them stands in field_cases_test.py."""

import importlib.util
import lzma
import pathlib
import struct
import subprocess
import sys
import zlib

import numpy as np
from PIL import Image

TEST = pathlib.Path(__file__).resolve().parents[1]
SCRIPTS = TEST.parent / "scripts"
sys.path.insert(0, str(SCRIPTS))
sys.path.insert(0, str(TEST / "ros"))
import poses  # noqa: E402
import synthetic_frames  # noqa: E402

HALF = np.array([1.0, 0.75, 0.5])
UTM = np.array([356789.123, 5412345.678, 123.456])
CORNERS = np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)]) * 2.0 - 1.0
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
         (1, 5, 7), (1, 7, 3)]
STRIPS = "30 0 1 2 3 -1 4 6 5 7 -1 0 4 1 5 -1 2 3 6 7 -1 0 2 4 6 -1 1 5 3 7 -1\n"


def ply_header(form, vertices, faces, type_="float", before=""):
    text = "ply\nformat %s 1.0\n%selement vertex %d\n" % (form, before, vertices)
    text += "".join("property %s %s\n" % (type_, axis) for axis in "xyz")
    if faces is not None:
        text += "element face %d\nproperty list uchar int vertex_indices\n" % faces
    return text + "end_header\n"


def vertex_lines(vertices):
    return "".join("%.9g %.9g %.9g\n" % tuple(v) for v in vertices)


def face_lines(faces):
    return "".join("3 %d %d %d\n" % tuple(f) for f in faces)


def ascii_box(scale=1.0, more_vertices=(), more_faces=()):
    vertices = list(scale * CORNERS * HALF) + list(more_vertices)
    faces = FACES + list(more_faces)
    return ply_header("ascii", len(vertices), len(faces)) + vertex_lines(vertices) + face_lines(faces)


def binary_faces(faces):
    return b"".join(struct.pack("<Biii", 3, *f) for f in faces)


def binary_box(more_faces=(), before="", before_data=b""):
    data = (CORNERS * HALF).astype("<f4").tobytes()
    header = ply_header("binary_little_endian", 8, len(FACES) + len(more_faces), before=before)
    return header.encode() + before_data + data + binary_faces(FACES + list(more_faces))


def write_frames(folder, count=30, pose=lambda T: T, units=1000.0, K=synthetic_frames.K):
    folder.mkdir(parents=True)
    np.savetxt(folder / "camera-intrinsics.txt", K, fmt="%.9g")
    for n, T in enumerate(synthetic_frames.camera_poses(count)):
        depth = np.round(units * synthetic_frames.render(T)).astype(np.uint16)
        Image.fromarray(depth).save(folder / ("frame-%06d.depth.png" % n))
        np.savetxt(folder / ("frame-%06d.pose.txt" % n), pose(T), fmt="%.9g")


def scan(T_map_camera):
    """Points of every second pixel, in the camera's frame [m]."""
    depth = synthetic_frames.render(T_map_camera)
    v, u = np.mgrid[0:synthetic_frames.HEIGHT:2, 0:synthetic_frames.WIDTH:2]
    z = depth[v, u]
    K = synthetic_frames.K
    return np.stack([(u - K[0, 2]) / K[0, 0] * z, (v - K[1, 2]) / K[1, 1] * z, z], axis=-1).reshape(-1, 3)


def pcd(points, size=4, type_="F", count="1 1 1", width=None, height=1, number=None, data="binary"):
    width = len(points) if width is None else width
    number = width if number is None else number
    letter = {("F", 4): "<f4", ("F", 8): "<f8", ("I", 2): "<i2", ("I", 4): "<i4"}.get((type_, size), "<f4")
    header = ("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE %s\nTYPE %s\nCOUNT %s\nWIDTH %s\nHEIGHT %s\n"
              "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS %s\nDATA %s\n"
              % (" ".join([str(size)] * 3), " ".join([type_] * 3), count, width, height, number, data))
    return header.encode() + np.asarray(points).astype(letter).tobytes()


def w2c(folder):
    write_frames(folder / "w2c", pose=poses.inverse)


def depth_scale(folder):
    write_frames(folder / "scale10000", units=10000.0)


def intrinsics(folder):
    K = synthetic_frames.K
    for name, other in (("kcolor", [[1165.7, 0, 649.1], [0, 1165.7, 484.8], [0, 0, 1]]),
                        ("kvga", [[525, 0, 319.5], [0, 525, 239.5], [0, 0, 1]]),
                        ("kneg", K * np.array([[-1.0, 1.0, 1.0]] + [[1.0] * 3] * 2))):
        write_frames(folder / name, K=np.array(other))


def points(folder):
    lines = vertex_lines(CORNERS * HALF)
    (folder / "points_only.ply").write_text(ply_header("ascii", 8, None) + lines)
    (folder / "faces0.ply").write_text(ply_header("ascii", 8, 0) + lines)


def mesh_segv(folder):
    whole = binary_box()
    camera = "element camera 1\nproperty float view_px\nproperty list uchar int ids\n"
    (folder / "bin_camera_first.ply").write_bytes(
        binary_box(before=camera, before_data=struct.pack("<fBiii", 1.0, 3, 0, 1, 2)))
    (folder / "bin_oob.ply").write_bytes(binary_box([(0, 1, 999999)]))
    (folder / "bin_trunc.ply").write_bytes(whole[:-4 * 13])
    (folder / "bin_trunc_half.ply").write_bytes(whole[:-8 * 13 - 6])
    (folder / "idx_neg.ply").write_text(ascii_box(more_faces=[(0, 1, -1)]))
    (folder / "idx_oob.ply").write_text(ascii_box(more_faces=[(0, 1, 99)]))


def mesh_partial(folder):
    whole = ascii_box()
    (folder / "ref.ply").write_text(whole)
    (folder / "ascii_trunc.ply").write_text(whole[:whole.index("3 0 6 4")])
    (folder / "strips.ply").write_text(
        ply_header("ascii", 8, None).replace("end_header", "element tristrips 1\nproperty list int int vertex_indices\n"
                                                           "end_header") + vertex_lines(CORNERS * HALF) + STRIPS)


def mesh_utm(folder):
    vertices = CORNERS * HALF + UTM
    obj = "".join("v %.6f %.6f %.6f\n" % tuple(v) for v in vertices)
    (folder / "utm.obj").write_text(obj + "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in FACES))
    (folder / "utm_double.ply").write_text(
        ply_header("ascii", 8, 12, "double") + "".join("%.6f %.6f %.6f\n" % tuple(v) for v in vertices) +
        face_lines(FACES))


def no_end(folder, volumes):
    (folder / "stray100.ply").write_text(
        ascii_box(more_vertices=[(100, 0, 0), (100, 1, 0), (100, 0, 1)], more_faces=[(8, 9, 10)]))
    subprocess.run([volumes, str(folder)], check=True)


def tiny_mesh(folder):
    (folder / "tiny.ply").write_text(ascii_box(1e-5))
    (folder / "tiny6.ply").write_text(ascii_box(1e-6))


def device_output(folder):
    (folder / "ref.ply").write_text(ascii_box())


def room_map(folder, build):
    """room.ttsdf, and a scan in it with prior and truth."""
    write_frames(folder / "frames")
    build("--frames", folder / "frames", "--every", 1, "--voxel-size", 0.04, "--truncation", 0.12, "--output",
          folder / "room.ttsdf")
    truth = synthetic_frames.camera_poses(30)[4]
    np.savetxt(folder / "truth.txt", truth)
    np.savetxt(folder / "prior.txt", truth @ poses.pose(poses.exp_so3([0.01, -0.02, 0.01]), [0.05, -0.04, 0.03]))
    return scan(truth)


def double_ply(folder, build):
    cloud = room_map(folder, build)
    header = ply_header("binary_little_endian", len(cloud), None, "double", "comment Created by Open3D\n")
    (folder / "o3d_double.ply").write_bytes(header.encode() + cloud.astype("<f8").tobytes())
    (folder / "double.pcd").write_bytes(pcd(cloud, 8))
    (folder / "int16.pcd").write_bytes(pcd(np.round(1000.0 * cloud), 2, "I"))
    (folder / "list.txt").write_text("".join("%s prior.txt truth.txt\n" % name
                                             for name in ("o3d_double.ply", "double.pcd", "int16.pcd")))


def same_point(folder):
    cloud = scan(synthetic_frames.camera_poses(30)[4])
    (folder / "f64.bin").write_bytes(cloud.astype("<f8").tobytes())
    (folder / "same.pcd").write_bytes(pcd(np.tile([[0.5, 0.4, 2.0]], (2000, 1))))


def map_file(folder, name, dims, mask=None, meta=None, voxel=0.1):
    """A rank-1 map of zeros by the page of the format, checksums right."""
    # Only the kind of lie differs: extents, a mask of many cells, texts of many bytes.
    geom = struct.pack("<3Id12d", *dims, voxel, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)
    field = struct.pack("<B3dI", 0, 0.5, 0.0, 0.0, 0)
    core = struct.pack("<B3B2I", 0, 0, 1, 2, 1, 1) + bytes(4 * sum(dims))
    sections = [(b"GEOM", 1, geom), (b"FIEL", 1, field)]
    if mask is not None:
        sections.append((b"MASK", 1, mask))
    if meta is not None:
        sections.append((b"META", 0, meta))
    sections.append((b"CORE", 1, core))
    table = b"".join(struct.pack("<4sIQII", n, f, len(d), zlib.crc32(d), 0) for n, f, d in sections)
    payload = b"".join(d for _, _, d in sections)
    head = b"TTSDF\r\n\x1a" + struct.pack("<IIQ", 1, len(sections), 32 + len(table) + len(payload))
    tail = struct.pack("<I", 0) + table
    (folder / name).write_bytes(head + struct.pack("<I", zlib.crc32(head + tail)) + tail + payload)


def coded(raw):
    """A compressed block of the maps' format."""
    filters = [{"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 20, "lc": 0, "lp": 0,
                "pb": 0}]
    block = lzma.compress(raw, format=lzma.FORMAT_RAW, filters=filters)
    return struct.pack("<I", len(block)) + block


def hostile_maps(folder):
    cells = 645 ** 3
    buckets = [0] * 16
    buckets[14] = cells  # nothing known anywhere: every cell as predicted from its neighbours
    map_file(folder, "b_mask28.ttsdf", (645,) * 3,
             mask=struct.pack("<17I", 1, *buckets) + coded(bytes((cells + 7) // 8)))
    map_file(folder, "b_vox34.ttsdf", (2580,) * 3)
    map_file(folder, "c_time.ttsdf", (820,) * 3)
    texts = struct.pack("<I", 1 << 15) + b"".join(struct.pack("<I3sI", 3, struct.pack(">I", n)[1:], 0)
                                                  for n in range(1 << 15))
    map_file(folder, "meta16.ttsdf", (2, 2, 2), meta=struct.pack("<I", len(texts)) + coded(texts))


def hostile_clouds(folder):
    six = np.arange(1.0, 7.0).reshape(2, 3)
    files = {"cnt_big.pcd": pcd(six, count="1 1 1000000000"), "neg.pcd": pcd(six, width=-1, height=-1),
             "int.pcd": pcd(six, type_="I"), "size3.pcd": pcd(six, size=3), "size_neg.pcd": pcd(six, size=-4),
             "size_big.pcd": pcd(six, size=2147483647), "p_1e9_bin.pcd": pcd(six, width=10 ** 9),
             "wh_overflow.pcd": pcd(six, width=65536, height=65536, number=0),
             "comp_huge.pcd": pcd(np.zeros((0, 3)), width=2, data="binary_compressed") + b"\n\0\0\0\xf0\xff\xff\xff" +
             bytes(10),
             "comp_raw1.pcd": pcd(np.zeros((0, 3)), width=100000, data="binary_compressed") +
             struct.pack("<III", 5, 4, 3),
             "ascii_nan.pcd": pcd(np.zeros((0, 3)), width=2, data="ascii") + b"nan inf -inf\nx y z\n",
             "no_data.pcd": b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n",
             "size8.pcd": pcd(six, 8)}
    huge = "ply\nformat %s 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    for name, type_, letter in (("dbl.ply", "double", "f8"), ("uchar.ply", "uchar", "u1")):
        files[name] = ply_header("binary_little_endian", 2, None, type_).encode() + np.zeros((2, 3), letter).tobytes()
    files["huge.ply"] = (huge % "binary_little_endian").encode() + six.astype("<f4").tobytes()
    files["upper.ply"] = (huge % "ascii").replace("ply", "PLY", 1).encode() + b"0 0 0\n"
    files["cr_only.ply"] = ((huge % "ascii") + "0 0 0\n").replace("\n", "\r").encode()
    files["list2.ply"] = (ply_header("binary_little_endian", 2, None).replace("end", "property list uint float w\nend", 1)
                          .encode() + struct.pack("<3fI", 1, 2, 3, 0x7fffffff) + bytes(20))
    # The same points in single and double precision: both must give the same.
    cloud = scan(synthetic_frames.camera_poses(30)[4])[::8]
    for name, type_, letter in (("f.ply", "float", "<f4"), ("d.ply", "double", "<f8")):
        header = ply_header("binary_little_endian", len(cloud), None, type_).encode()
        files[name] = header + cloud.astype("<f4").astype(letter).tobytes()
    for name, content in files.items():
        (folder / name).write_bytes(content)


def hostile_meshes(folder):
    four = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4")
    good = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]

    def binary(faces, vertices=four, promised=4, before="", before_data=b""):
        header = ply_header("binary_little_endian", 4, promised, before=before)
        return header.encode() + before_data + vertices.tobytes() + binary_faces(faces)
    head = ply_header("ascii", 4, 1)
    lines = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    camera = "element camera 1\nproperty list uchar float view\nproperty float x\n"
    files = {"ascii_index.ply": head + lines + "3 0 1 999999\n", "ascii_no_faces.ply": head + lines,
             "camera_list_first.ply": binary(good, before=camera, before_data=struct.pack("<Bfff", 2, 2.0, 3.0, 0.0)),
             "trunc_faces.ply": binary(good)[:-30], "trunc_vertices.ply": binary([], four[:1])[:-4],
             "ply_fmt.ply": "ply\nformat ascii 1.0\n", "coff.off": "COFF\n4000000000 1 0\n0 0 0\n",
             "off_idx.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 99999999\n",
             "off_nofaces.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n",
             "off_ws.off": "  OFF\n400000000 100000000 0\n0 0 0\n",
             "obj_poly.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + " 1 2 3" * 66667 + "\n",
             "list_count_268M.ply": ply_header("binary_little_endian", 4, 1).replace("uchar", "uint").encode() +
             four.tobytes() + struct.pack("<Iiii", 1 << 28, 0, 1, 2),
             "pcl_range_grid_overflow.ply": b"ply\nformat binary_little_endian 1.0\nobj_info num_cols 2\n"
             b"obj_info num_rows 2\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
             b"element range_grid 3\nprop\x12rty list uchar int vertex_indices\nend_header\n" + bytes(40)}
    for name, index in (("index_huge", 2 ** 31 - 1), ("index_negative", -1), ("index_out_of_range", 999999)):
        files[name + ".ply"] = binary(good[:1] + [(0, 1, index)] + good[2:])
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def hostile(folder, volumes):
    hostile_maps(folder)
    hostile_clouds(folder)
    hostile_meshes(folder)
    subprocess.run([volumes, str(folder)], check=True)
    (folder / "cycle.yaml").write_text("a: &a [*a]\n")
    (folder / "deep.yaml").write_text("voxel_size: " + 100000 * "[" + 100000 * "]" + "\n")
    Image.fromarray(np.zeros((16384, 16384), np.uint16)).save(folder / "zeros_16384.png")
    frames = folder / "frames"
    frames.mkdir()
    for n in range(3):
        depth = np.full((72, 96), 1000, np.uint16)
        Image.fromarray(depth).save(frames / ("frame-%06d.depth.png" % n))
        np.savetxt(frames / ("frame-%06d.pose.txt" % n), poses.pose(None, [0.05 * n, 0.0, 0.0]), fmt="%g")
    for name, f, c in (("camera-intrinsics", 80, 48), ("intrinsics_cx_huge", 80, 1e300), ("intrinsics_fx_0.001", 0.001, 48)):
        np.savetxt(frames / (name + ".txt"), [[f, 0, c], [0, f, 36], [0, 0, 1]], fmt="%.9g")
    np.savetxt(frames / "pose_1e5_m.txt", poses.pose(None, [1e5, 1e5, 0.0]), fmt="%.9g")


def has_rosbag():
    return importlib.util.find_spec("rosbag") is not None


def write_bag(folder, name, edit):
    """60 frames at 10 Hz with odometry that drifts; `edit` gives the messages that stand in one's place."""
    import rosbag
    frames = folder / "frames"
    if not frames.exists():
        write_frames(frames, 60)
    plain = folder / "plain.bag"
    if not plain.exists():
        subprocess.run([sys.executable, str(SCRIPTS / "frames_to_bag"), str(frames), str(plain), "--rate", "10"], check=True,
                       stderr=subprocess.DEVNULL)
    with rosbag.Bag(str(plain)) as given, rosbag.Bag(str(folder / name), "w") as made:
        for topic, message, stamp in given.read_messages():
            for other_topic, other in edit(topic, message):
                made.write(other_topic, other, stamp)


def row_step(folder):
    from sensor_msgs.msg import PointCloud2, PointField

    def cloud(whole):
        def edit(topic, message):
            if topic != "camera/depth/image_rect":
                return [] if topic == "camera/depth/camera_info" else [(topic, message)]
            z = np.frombuffer(message.data, "<u2").reshape(message.height, message.width)[::2, ::2] / 1000.0
            v, u = np.mgrid[0:message.height:2, 0:message.width:2]
            K = synthetic_frames.K
            data = np.stack([(u - K[0, 2]) / K[0, 0] * z, (v - K[1, 2]) / K[1, 1] * z, z], axis=-1).astype("<f4").tobytes()
            fields = [PointField("xyz"[n], 4 * n, PointField.FLOAT32, 1) for n in range(3)]
            return [("camera/depth/points", PointCloud2(message.header, z.shape[0], z.shape[1], fields, False, 12,
                                                        len(data) if whole else 0, data, True))]
        return edit
    write_bag(folder, "c_row0.bag", cloud(False))
    write_bag(folder, "c_rowall.bag", cloud(True))


def camera_info(change):
    def edit(topic, message):
        if topic == "camera/depth/camera_info":
            change(message)
        return [(topic, message)]
    return edit


def binning_roi(folder):
    def doubled(message):  # the sensor has twice the pixels each way
        message.binning_x = message.binning_y = 2
        message.width, message.height = 2 * message.width, 2 * message.height
        for matrix in ("K", "P"):
            values = list(getattr(message, matrix))
            for n in ((0, 4) if matrix == "K" else (0, 5)):
                values[n] *= 2.0
            for n in ((2, 5) if matrix == "K" else (2, 6)):
                values[n] = 2.0 * values[n]
            setattr(message, matrix, values)

    def part(message):  # from (100, 60) of a larger image on
        message.roi.x_offset, message.roi.y_offset = 100, 60
        message.roi.width, message.roi.height = message.width, message.height
        message.width, message.height = message.width + 200, message.height + 100
        for matrix, (x, y) in (("K", (2, 5)), ("P", (2, 6))):
            values = list(getattr(message, matrix))
            values[x], values[y] = values[x] + 100.0, values[y] + 60.0
            setattr(message, matrix, values)
    write_bag(folder, "binning.bag", camera_info(doubled))
    write_bag(folder, "roi.bag", camera_info(part))


def zero_poses(folder):
    write_bag(folder, "nostatic.bag", lambda topic, message: [] if topic == "/tf_static" else [(topic, message)])
