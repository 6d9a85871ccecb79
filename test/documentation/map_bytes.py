"""Numbers, texts and compressed blocks out of the bytes of a map file (doc/map_format.md)."""

import lzma
import struct

import numpy as np

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
