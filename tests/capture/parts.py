"""In: the address of a GigE Vision camera, a number of buffers. Out: what Aravis reads of them, one JSON line a buffer.
Frame and unit: bytes as Aravis hands them out. Debian's Python runs this, because PyGObject is built for it alone.
"""

import json
import sys

import gi

gi.require_version("Aravis", "0.8")
from gi.repository import Aravis  # noqa: E402

if not hasattr(Aravis.Buffer, "get_n_parts"):
    sys.exit("this Aravis is older than its reader of several parts")
address, count = sys.argv[1], int(sys.argv[2])
camera = Aravis.Camera.new(address)
camera.gv_set_multipart(True)
stream = camera.create_stream(None, None)
for _ in range(2 * count):
    stream.push_buffer(Aravis.Buffer.new_allocate(1 << 20))
camera.start_acquisition()
for _ in range(count):
    buffer = stream.timeout_pop_buffer(2_000_000)
    if buffer is None:
        sys.exit("no buffer within 2 s")
    whole = buffer.get_status() == Aravis.BufferStatus.SUCCESS
    parts = [
        [
            buffer.get_part_data_type(i).value_nick,
            buffer.get_part_pixel_format(i),
            [buffer.get_part_width(i), buffer.get_part_height(i)],
            bytes(buffer.get_part_data(i)).hex(),
        ]
        for i in range(buffer.get_n_parts() if whole else 0)
    ]
    payload = buffer.get_payload_type().value_nick
    print(json.dumps({"status": buffer.get_status().value_nick, "payload": payload, "parts": parts}))
camera.stop_acquisition()
