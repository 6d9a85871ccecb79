"""Reads a map file as doc/map_format.md describes it, and refuses what that page refuses.

Written from the page and not from the C++ reader, so that each checks the other. numpy and the standard
library only.
"""

import bisect
import lzma
import struct
import zlib

import numpy as np

MAGIC = b"TTSDF\r\n\x1a"
KNOWN_SECTIONS = ("GEOM", "FIEL", "CORE", "MASK", "META", "AGRE")
ENCODINGS = ("float32", "float16", "quantized-1", "quantized")
MAX_EXTENT = 1 << 20
MAX_NUMBERS = 1 << 26
MAX_CELLS = 1 << 28
MAX_TEXT = 16 << 20
MAX_FRAMES = 1 << 30
LZMA = [{"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 1 << 20,
         "lc": 0, "lp": 0, "pb": 0}]


class FormatError(ValueError):
    """The bytes are no map."""


def require(condition, what):
    if not condition:
        raise FormatError(what)


class Cursor:
    """Little-endian numbers out of bytes, in order."""

    def __init__(self, data):
        self.data, self.at = bytes(data), 0

    def take(self, size):
        require(self.at + size <= len(self.data), "bytes missing")
        self.at += size
        return self.data[self.at - size:self.at]

    def numbers(self, layout):
        layout = "<" + layout
        return struct.unpack(layout, self.take(struct.calcsize(layout)))

    def number(self, layout):
        return self.numbers(layout)[0]

    def block(self):
        return self.take(self.number("I"))

    def text(self):
        try:
            return self.block().decode("utf-8")
        except UnicodeDecodeError as error:
            raise FormatError(str(error)) from error

    def end(self):
        require(self.at == len(self.data), "bytes left over")


def inflate(coded, size):
    try:
        raw = lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=LZMA).decompress(coded, size + 1)
    except lzma.LZMAError as error:
        raise FormatError(str(error)) from error
    require(len(raw) == size, "compressed block of another size")
    return raw


def bits(data, count):
    """The first bit of a byte is its lowest."""
    return np.unpackbits(np.frombuffer(data, np.uint8), count=count, bitorder="little").astype(bool)


def packed_size(count):
    return (count + 7) // 8


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


def read_varint(cursor):
    value = 0
    for n in range(4):
        byte = cursor.number("B")
        value |= (byte & 127) << (7 * n)
        if byte < 128:
            break
    require(value <= (1 << 24) - 4, "coefficient")
    return value


def expected_order(tables):
    """Indices of the coefficients that are coded, the largest expected first, ties in storage order."""
    levels, coded = [], []
    for a, b, c in tables:
        levels.append((a[:, None, None] + b[None, :, None] + c[None, None, :]).ravel(order="F"))
        coded.append(((a[:, None, None] > 0) & (b[None, :, None] > 0) & (c[None, None, :] > 0)).ravel("F"))
    levels, indices = np.concatenate(levels), np.flatnonzero(np.concatenate(coded))
    return indices[np.argsort(-levels[indices], kind="stable")]


def read_coefficients(cursor, extents):
    """Integer arrays of the given extents, first index fastest."""
    packed = Cursor(inflate(cursor.block(), sum(map(sum, extents))))
    tables = []
    for block in extents:
        levels = [np.cumsum(np.frombuffer(packed.take(n), np.uint8), dtype=np.uint8) for n in block]
        require(all((level <= 127).all() for level in levels), "table of magnitudes")
        tables.append([level.astype(int) for level in levels])
    order = expected_order(tables)
    values = np.zeros(sum(int(np.prod(block)) for block in extents), int)
    alive = order
    for layer in range(3):
        above = bits(inflate(cursor.block(), packed_size(len(alive))), len(alive))
        alive = alive[above]
        values[alive] = layer + 1
    size = cursor.number("I")
    require(len(alive) <= size <= 4 * len(alive), "bytes of large coefficients")
    large = Cursor(inflate(cursor.block(), size))
    for n in alive:
        values[n] += read_varint(large)
    large.end()
    nonzero = order[values[order] > 0]
    negative = nonzero[bits(cursor.take(packed_size(len(nonzero))), len(nonzero))]
    values[negative] = -values[negative]
    ends = np.cumsum([np.prod(block) for block in extents])
    return [part.reshape(block, order="F") for part, block in zip(np.split(values, ends[:-1]), extents)]


SQUASH = (1, 2, 3, 6, 10, 16, 27, 45, 73, 120, 194, 310, 488, 747, 1101, 1546, 2047, 2549, 2994, 3348, 3607, 3785,
          3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094)
LEVELS = (1, 2, 3, 4, 5, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128, 181, 256, 362, 512, 724, 1024, 1448, 2048, 2896)


def squash(x):
    weight, n = x & 127, (x >> 7) + 16
    return (SQUASH[n] * (128 - weight) + SQUASH[n + 1] * weight + 64) >> 7


def stretch_table():
    table = []
    for x in range(-2047, 2048):
        table += [x] * (squash(x) + 1 - len(table))
    return table + [2047] * (4096 - len(table))


STRETCH = stretch_table()


def divide(a, b):
    """Towards zero, as C does."""
    return a // b if a >= 0 else -(-a // b)


def level(scaled):
    return min(23, bisect.bisect_right(LEVELS, scaled))


class RangeCoded:
    """Bits out of a range-coded stream."""

    def __init__(self, cursor):
        self.data, self.at, self.end = cursor.take(len(cursor.data) - cursor.at), 0, cursor
        self.low, self.high, self.value = 0, 0xFFFFFFFF, 0
        for _ in range(4):
            self.value = self.value << 8 | self.next()

    def next(self):
        self.at += 1
        return self.data[self.at - 1] if self.at <= len(self.data) else 0

    def bit(self, probability):
        middle = self.low + ((self.high - self.low) >> 12) * probability
        one = self.value <= middle
        if one:
            self.high = middle
        else:
            self.low = middle + 1
        while (self.low ^ self.high) >> 24 == 0:
            self.low = self.low << 8 & 0xFFFFFFFF
            self.high = self.high << 8 & 0xFFFFFFFF | 255
            self.value = self.value << 8 & 0xFFFFFFFF | self.next()
        return one


class BitModel:
    """Mixes the predictions of eight contexts."""

    def __init__(self):
        self.counters, self.weights = {}, {}

    def read(self, stream, places, weight_set):
        counters = [(n, place) for n, place in enumerate(places)]
        states = [self.counters.get(key, (1 << 21, 0)) for key in counters]
        inputs = [STRETCH[probability >> 10] for probability, _ in states]
        weights = self.weights.setdefault(weight_set, [19660] * 8)
        mixed = divide(sum(w * x for w, x in zip(weights, inputs)), 65536)
        mixed = squash(max(-2047, min(2047, mixed)))
        bit = stream.bit(max(1, min(4095, mixed)))
        error = ((4096 if bit else 0) - mixed) * 50
        target = (1 << 22) - 1 if bit else 0
        for n, (probability, seen) in enumerate(states):
            weights[n] += divide(inputs[n] * error, 65536)
            probability += divide((target - probability) * (131072 // (2 * seen + 3)), 65536)
            self.counters[counters[n]] = (probability, min(seen + 1, 127))
        return bit


def read_magnitude(stream, model, contexts, expected):
    def decide(decision):
        return model.read(stream, [(context, decision) for context in contexts], (decision, expected))

    value = 0
    while value < 16 and decide(value):
        value += 1
    if value < 16:
        return value
    length = 0
    while length < 24 and decide(min(16 + length, 39)):
        length += 1
    number = 1
    for _ in range(length):
        number = number << 1 | stream.bit(2048)
    return min(number - 1 + 16, (1 << 24) - 1)


def read_box(stream, extents):
    n0, n1, n2 = extents
    values = np.zeros((n0 + 2, n1 + 3, n2 + 2), int)  # a border of zeros: -1 and -2 are beyond the end
    signs = np.ones((n0, n1, n2), int)
    model = BitModel()
    entry = [[0] * n1 for _ in range(n0)]
    row, column, across, row_sum, column_sum = [0] * n0, [0] * n1, [0] * n0, [0] * n0, [0] * n1
    for c in range(n2):
        row_before, column_before = [x // n1 for x in row_sum], [x // n0 for x in column_sum]
        row_sum, column_sum = [0] * n0, [0] * n1
        for b in range(n1):
            require(stream.at <= len(stream.data), "stream of coefficients")
            along = 0
            for a in range(n0):
                at = lambda i, j, k: int(values[i, j, k])
                same, before = entry[a][b], at(a, b, c - 1)
                beside = 2 * at(a - 1, b, c) + 2 * at(a, b - 1, c) + at(a - 1, b - 1, c) + at(a + 1, b - 1, c)
                around = at(a + 1, b, c - 1) + at(a, b + 1, c - 1) + at(a - 1, b, c - 1) + at(a, b - 1, c - 1)
                earlier = (2 * before + at(a, b, c - 2)) * 256 // 3
                expected = level((5 * same + 5 * earlier + 10 * along + 6 * across[a] + 3 * column_before[b] +
                                  3 * row_before[a]) // 32 // 16)
                contexts = ((level(same // 16), level(16 * before)), (level(row[a] // 16), level(column[b] // 16)),
                            (level(16 * beside // 6), level(4 * around)), (expected, level(16 * beside // 6)),
                            (level(along // 16), level(across[a] // 16)),
                            (level(earlier // 16), level(16 * (2 * at(a, b - 1, c) + at(a, b - 2, c)) // 3)),
                            (level(column_before[b] // 16), level(row_before[a] // 16)), (expected, 0))
                size = read_magnitude(stream, model, contexts, expected)
                if size and stream.bit(2048):
                    signs[a, b, c] = -1
                values[a, b, c] = size
                counted = min(size, 40) * 256
                entry[a][b] = counted if c == 0 else same + divide(counted - same, 4)
                row[a] += divide(counted - row[a], 16)
                column[b] += divide(counted - column[b], 16)
                along += divide(counted - along, 4)
                across[a] += divide(counted - across[a], 4)
                row_sum[a] += counted
                column_sum[b] += counted
    return signs * values[:n0, :n1, :n2]


def read_range_coded(cursor, extents):
    """Integer arrays of the given extents, first index fastest."""
    stream = RangeCoded(cursor)
    boxes = [read_box(stream, box) for box in extents]
    require(stream.at == len(stream.data), "stream of coefficients")
    return boxes


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
