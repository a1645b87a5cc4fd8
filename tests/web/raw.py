"""In: recorded pictures. Out: the same pictures as raw bytes of a camera, sent at a steady rate.
Frame and unit: px, pictures a second."""

import struct
import threading
import time
import zlib

from browser import unfilter


def grey(path):
    """The grey levels of an 8-bit PNG, row by row, as a sensor delivers them."""
    with open(path, "rb") as f:
        png = f.read()
    width, height = struct.unpack(">II", png[16:24])
    place, data = 8, b""
    while place < len(png):
        length, kind = struct.unpack(">I4s", png[place:place + 8])
        data += png[place + 8:place + 8 + length] if kind == b"IDAT" else b""
        place += 12 + length
    raw, before, rows = zlib.decompress(data), bytearray(width), []
    for y in range(height):
        before = unfilter(raw[y * (width + 1)], bytearray(raw[y * (width + 1) + 1:(y + 1) * (width + 1)]), before, 1)
        rows.append(bytes(before))
    return b"".join(rows)


class Feed:
    """Sends the pictures cyclically until `end`. The first four pixels of each hold its number; `sent[number]` is the time at
    which its last byte was sent."""

    def __init__(self, pipe, frames, rate):
        self.pipe, self.frames, self.rate, self.sent, self.over = pipe, frames, rate, [], False
        self.goes = threading.Event()
        self.goes.set()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        due = time.time()
        while not self.over:
            self.goes.wait()
            n = len(self.sent)
            self.pipe.write(struct.pack("<I", n) + self.frames[n % len(self.frames)][4:])
            self.pipe.flush()
            self.sent.append(time.time())
            due = max(due + 1 / self.rate, time.time() - 1)
            time.sleep(max(0.0, due - time.time()))
        self.pipe.close()

    def rest(self, rests):
        """Pauses sending, or continues it."""
        self.goes.clear() if rests else self.goes.set()

    def end(self):
        self.over = True
        self.goes.set()
        self.thread.join(20)
