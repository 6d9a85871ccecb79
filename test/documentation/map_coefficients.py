"""The two codings of a map file's coefficients (doc/map_format.md): in layers of bits, and range-coded with mixed contexts."""

import bisect

import numpy as np

from map_bytes import Cursor, bits, inflate, packed_size, require

# ---- in layers of bits -----------------------------------------------------------------------------------

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


# ---- range-coded -----------------------------------------------------------------------------------------

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
