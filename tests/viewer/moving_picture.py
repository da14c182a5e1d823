"""A few small pictures of a moving square, as PNG files in memory (standard library only)."""

import struct
import zlib

WIDTH, HEIGHT, SQUARE = 320, 240, 48
BACKGROUND, FOREGROUND = b"\x20\x30\x48", b"\xf0\xb0\x40"


def frames(count):
    """Returns `count` different frames, each the bytes of a PNG file."""
    step = (WIDTH - SQUARE) // count
    return [_frame(step * number) for number in range(count)]


def _frame(left):
    empty = b"\0" + BACKGROUND * WIDTH
    crossed = b"\0" + BACKGROUND * left + FOREGROUND * SQUARE + BACKGROUND * (WIDTH - SQUARE - left)
    margin = (HEIGHT - SQUARE) // 2
    rows = empty * margin + crossed * SQUARE + empty * margin
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
