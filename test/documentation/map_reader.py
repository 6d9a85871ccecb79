"""Reads a map file as doc/map_format.md describes it, and refuses what that page refuses.

Written from the page and not from the C++ reader, so that each checks the other. numpy and the standard
library only.
"""

import struct
import zlib

import numpy as np

from map_bytes import Cursor, bits, inflate, packed_size, require
from map_coefficients import read_coefficients, read_range_coded

MAGIC = b"TTSDF\r\n\x1a"
KNOWN_SECTIONS = ("GEOM", "FIEL", "CORE", "MASK", "META", "AGRE")
ENCODINGS = ("float32", "float16", "quantized-1", "quantized")
MAX_EXTENT = 1 << 20
MAX_NUMBERS = 1 << 26
MAX_CELLS = 1 << 28
MAX_TEXT = 16 << 20
MAX_FRAMES = 1 << 30


# ---- container -------------------------------------------------------------------------------------------

def sections(data):
    """Checks header, table and every checksum; returns {name: payload}."""
    cursor = Cursor(data)
    require(cursor.take(8) == MAGIC, "magic")
    version, count, file_bytes, checksum, reserved = cursor.numbers("IIQII")
    require(version == 1, "version")
    require(reserved == 0, "reserved field of the header")
    require(file_bytes == len(data), "size of the file")
    require(count <= 64, "number of sections")
    table = cursor.take(24 * count)
    require(zlib.crc32(table, zlib.crc32(data[28:32], zlib.crc32(data[:24]))) == checksum, "header checksum")
    found = {}
    for name, flags, size, crc, reserved in struct.iter_unpack("<4sIQII", table):
        require(reserved == 0, "reserved field of a section")
        payload = cursor.take(size)
        require(zlib.crc32(payload) == crc, "section checksum")
        name = name.decode("latin-1")
        require(name not in found, "section twice")
        require(name in KNOWN_SECTIONS or not flags & 1, "unknown section that must be known")
        found[name] = payload
    cursor.end()
    for name in ("GEOM", "FIEL", "CORE"):
        require(name in found, "section " + name)
    return found


# ---- sections --------------------------------------------------------------------------------------------

def read_geometry(payload):
    cursor = Cursor(payload)
    dims = cursor.numbers("III")
    require(all(1 <= extent <= MAX_EXTENT for extent in dims), "extents")
    require(np.prod([float(extent) for extent in dims]) <= 2**34, "number of voxels")
    voxel_size = cursor.number("d")
    transform = np.vstack([np.reshape(cursor.numbers("12d"), (3, 4)), [0, 0, 0, 1]])
    cursor.end()
    require(1e-5 <= voxel_size <= 100, "voxel size")
    R = transform[:3, :3]
    require(np.isfinite(transform).all() and np.abs(R @ R.T - np.eye(3)).max() < 1e-6 and
            np.linalg.det(R) > 0, "transform")
    return {"dims": dims, "voxel_size": voxel_size, "T_map_grid": transform}


def read_field(payload):
    cursor = Cursor(payload)
    kind, truncation, negative, positive = cursor.numbers("Bddd")
    frame_id = cursor.text()
    cursor.end()
    require(kind in (0, 1), "field kind")
    require(all(np.isfinite(d) and d >= 0 for d in (truncation, negative, positive)), "distances")
    return {"field": ("sdf", "tsdf")[kind], "truncation": truncation, "clamp_negative": negative,
            "clamp_positive": positive, "frame_id": frame_id}


def read_agreement(payload):
    """Three numbers of frames, then eight sizes."""
    cursor = Cursor(payload)
    counts = cursor.numbers("3I")
    require(max(counts) <= MAX_FRAMES, "frames")
    sizes = cursor.numbers("8d")
    cursor.end()
    require(all(np.isfinite(size) and size >= 0.0 for size in sizes) and sizes[4] >= 1.0, "sizes")
    return [*counts, *sizes]


def read_viewpoints(payload):
    """Distance, then position, view, frames and ratio of each."""
    cursor = Cursor(payload)
    count, distance, step = cursor.number("H"), cursor.number("f"), cursor.number("f")
    viewpoints = []
    for _ in range(count):
        x, y, z, *view, frames, ratio = cursor.numbers("3h3bBB")
        viewpoints.append([step * x, step * y, step * z, *(v / 127.0 for v in view), frames, 2.0 ** ((ratio - 128) / 16)])
    cursor.end()
    require(not viewpoints or (np.isfinite(distance) and distance > 0.0), "distance of viewpoints")
    require(np.isfinite(viewpoints).all() and all(v[6] >= 1 for v in viewpoints), "viewpoints")
    return [distance, *np.ravel(viewpoints).tolist()]


def read_metadata(payload):
    cursor = Cursor(payload)
    size = cursor.number("I")
    require(size <= MAX_TEXT, "metadata")
    text = Cursor(inflate(cursor.block(), size))
    cursor.end()
    metadata = {}
    for _ in range(text.number("I")):
        key = text.text()
        metadata[key] = text.text()
    text.end()
    return metadata


NEIGHBOURS = ((-1, 0, 0, 22), (0, -1, 0, 20), (0, 0, -1, 18), (-1, -1, 0, 3), (1, -1, 0, 10),
              (-1, 0, -1, -1), (1, 0, -1, 5), (0, 1, -1, 11), (1, 1, -1, 6), (-1, -1, -1, -4))


def read_mask(payload, dims):
    """(cell_voxels, bool array [a, b, c])."""
    cursor = Cursor(payload)
    cell = cursor.number("I")
    require(1 <= cell <= 1 << 20, "cell size")
    cells = [(extent - 1) // cell + 1 for extent in dims]
    require(np.prod(cells, dtype=float) <= MAX_CELLS, "cells")
    counts = cursor.numbers("16I")
    require(sum(counts) == np.prod(cells), "coded cells")
    packed = Cursor(inflate(cursor.block(), sum(map(packed_size, counts))))
    cursor.end()
    buckets = [iter(bits(packed.take(packed_size(count)), count).tolist()) for count in counts]
    mask = np.zeros([extent + 2 for extent in cells], int)  # a border of zeros: neighbours beyond the grid
    for c in range(1, cells[2] + 1):
        for b in range(1, cells[1] + 1):
            for a in range(1, cells[0] + 1):
                odds = sum(weight * mask[a + i, b + j, c + k] for i, j, k, weight in NEIGHBOURS) - 44
                surprise = next(buckets[min(abs(odds) // 3, 15)], None)
                require(surprise is not None, "cells that do not fit their prediction")
                mask[a, b, c] = (odds >= 0) != surprise
    return cell, mask[1:-1, 1:-1, 1:-1].astype(bool)


# ---- cores -----------------------------------------------------------------------------------------------

def cosines(n):
    """Orthonormal DCT-II, row = frequency."""
    f, k = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    scale = np.sqrt(np.where(f == 0, 1.0, 2.0) / n)
    return scale * np.cos(np.pi * (2 * k + 1) * f / (2 * n))


def from_frequencies(values):
    """Along the last axis."""
    n = values.shape[-1]
    return values @ cosines(n) if n <= 2048 else values


def dequantize(q, step, offsets):
    magnitude = np.abs(q)
    offset = np.where(magnitude > 1, offsets[1], offsets[0]) / 128.0
    return np.sign(q) * step * np.where(magnitude > 0, magnitude + offset, 0.0)


def read_quantized(cursor, n1, n2, n3, r1, r2, read):
    def step():
        value = cursor.number("f")
        require(np.isfinite(value) and value > 0, "quantisation step")
        return value

    def basis(rank):
        return step(), cursor.numbers("bb"), np.frombuffer(cursor.take(rank), np.uint8)

    middle_step, middle_offsets = step(), cursor.numbers("bb")
    first, last = basis(r1), basis(r2)
    q1, q2, q3 = read(cursor, [(n1, r1, 1), (r1, r2, n2), (n3, r2, 1)])

    def decoded(q, basis):
        finest, offsets, coarseness = basis
        return from_frequencies(dequantize(q[:, :, 0].T, (finest * 2.0 ** (coarseness / 4.0))[:, None],
                                           offsets)).T

    middle = from_frequencies(dequantize(q2, middle_step, middle_offsets))
    return decoded(q1, first), middle, decoded(q3, last)


def read_cores(payload, dims):
    """Encoding, mode order and the cores G1 [n1, r1], G2 [r1, r2, n2], G3 [n3, r2]."""
    cursor = Cursor(payload)
    encoding, *axes, r1, r2 = cursor.numbers("4BII")
    require(encoding < 4, "encoding")
    require(sorted(axes) == [0, 1, 2], "mode order")
    n1, n2, n3 = (dims[axis] for axis in axes)
    require(1 <= r1 <= min(n1, n2 * n3) and 1 <= r2 <= min(n3, n1 * n2) and
            n1 * r1 + r1 * n2 * r2 + r2 * n3 <= MAX_NUMBERS, "ranks")
    if encoding >= 2:
        cores = read_quantized(cursor, n1, n2, n3, r1, r2, read_coefficients if encoding == 2 else read_range_coded)
    else:
        kind = ("<f4", "<f2")[encoding]

        def plain(rows, columns):
            raw = cursor.take(rows * columns * np.dtype(kind).itemsize)
            return np.frombuffer(raw, kind).astype(float).reshape((rows, columns), order="F")

        first = plain(n1, r1)
        middle = plain(r1, n2 * r2).reshape((r1, r2, n2), order="F")
        cores = first, middle, plain(r2, n3).T
    cursor.end()
    require(all(np.isfinite(core).all() for core in cores), "cores")
    return {"encoding": ENCODINGS[encoding], "axes": axes, "ranks": (r1, r2), "cores": cores}


def read_map(data):
    """Everything the file says, as a dictionary."""
    found = sections(data)
    result = {"map_id": "%08x" % zlib.crc32(data), "sections": list(found)}
    result.update(read_geometry(found["GEOM"]))
    result.update(read_field(found["FIEL"]))
    result["cell_voxels"], result["mask"] = (read_mask(found["MASK"], result["dims"])
                                             if "MASK" in found else (1, None))
    result["metadata"] = read_metadata(found["META"]) if "META" in found else {}
    result["agreement"] = read_agreement(found["AGRE"]) if "AGRE" in found else None
    result["viewpoints"] = read_viewpoints(found["VIEW"]) if "AGRE" in found and "VIEW" in found else None
    result.update(read_cores(found["CORE"], result["dims"]))
    return result


# ---- what the numbers mean -------------------------------------------------------------------------------

def sample(field_map, indices):
    """Values at integer sample indices (n x 3, array order x y z) [m]."""
    G1, G2, G3 = field_map["cores"]
    i, j, k = (np.asarray(indices)[:, axis] for axis in field_map["axes"])
    return np.einsum("na,abn,nb->n", G1[i], G2[:, :, j], G3[k])


def position(field_map, indices):
    """Where those samples sit in the map frame [m]."""
    T = field_map["T_map_grid"]
    return field_map["voxel_size"] * np.asarray(indices) @ T[:3, :3].T + T[:3, 3]


def supported(field_map, indices):
    if field_map["mask"] is None:
        return np.ones(len(indices), bool)
    a, b, c = (np.asarray(indices) // field_map["cell_voxels"]).T
    return field_map["mask"][a, b, c]


def main(path):
    with open(path, "rb") as file:
        data = file.read()
    field_map = read_map(data)
    found = sections(data)
    print("%8d  header and table of sections" % (32 + 24 * len(found)))
    for name, payload in found.items():
        print("%8d  %s" % (len(payload), name))
    print("%8d  bytes, map %s" % (len(data), field_map["map_id"]))
    for key in ("dims", "voxel_size", "field", "truncation", "clamp_negative", "clamp_positive", "frame_id",
                "cell_voxels", "encoding", "axes", "ranks", "metadata", "agreement", "viewpoints"):
        print("%s: %s" % (key, field_map[key]))


if __name__ == "__main__":
    import sys
    main(sys.argv[1])
