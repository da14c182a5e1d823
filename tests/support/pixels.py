"""The pixels of a PNG file as browsers make screenshots: 8 bits a channel, not interlaced (standard library only)."""

import struct
import zlib


class Pixels:
    def __init__(self, png):
        assert png.startswith(b"\x89PNG\r\n\x1a\n")
        data, at = b"", 8
        while at < len(png):
            size, kind = struct.unpack(">I4s", png[at:at + 8])
            body = png[at + 8:at + 8 + size]
            if kind == b"IHDR":
                self.width, self.height, depth, colours, _, _, interlaced = struct.unpack(">IIBBBBB", body)
                assert depth == 8 and colours in (2, 6) and not interlaced
                self._channels = 3 if colours == 2 else 4
            elif kind == b"IDAT":
                data += body
            at += 12 + size
        self._rows = self._unfilter(zlib.decompress(data))

    def at(self, x, y):
        """(red, green, blue), each 0 to 255."""
        start = int(x) * self._channels
        return tuple(self._rows[int(y)][start:start + 3])

    def _unfilter(self, data):
        step, length = self._channels, self.width * self._channels
        rows, above = [], bytearray(length)
        for y in range(self.height):
            kind, row = data[y * (length + 1)], bytearray(data[y * (length + 1) + 1:(y + 1) * (length + 1)])
            for i in range(length if kind else 0):
                left, up = (row[i - step] if i >= step else 0), above[i]
                corner = above[i - step] if i >= step else 0
                if kind == 1:
                    guess = left
                elif kind == 2:
                    guess = up
                elif kind == 3:
                    guess = (left + up) // 2
                else:
                    estimate = left + up - corner
                    guess = min((left, up, corner), key=lambda value: abs(estimate - value))  # the first of equals
                row[i] = (row[i] + guess) & 255
            rows.append(row)
            above = row
        return rows
