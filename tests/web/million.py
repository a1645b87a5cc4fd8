"""In: the program, a folder with a simulated station and its scan. Out: printed figures of the 3-D view of a million points:
time to the first view, frame rate of a rotation and its number of points. Failure if the screen does not state how many
points it draws of how many, if it never draws all, or if a picked point is not in the cloud.
Frame and unit: mm, s, pictures a second."""

import os
import re
import struct
import sys
import tempfile
import time

from browser import Browser
from server import Server
from shots import quiet

program, folder = sys.argv[1:3]
MILLION = 1_000_000


def grown(path):
    """Repeats the points of a binary PLY with one element, slightly shifted, until there are a million. Returns their number."""
    with open(path, "rb") as f:
        data = f.read()
    at = data.index(b"end_header\n") + 11
    head = data[:at].decode()
    n = int(re.search(r"element vertex (\d+)", head)[1])
    sizes = {"float": 4, "double": 8, "uint": 4, "int": 4, "ushort": 2, "uchar": 1, "float32": 4, "uint32": 4, "uint16": 2, "uint8": 1}
    fields = [line.split()[1:] for line in head.splitlines() if line.startswith("property")]
    size = sum(sizes[kind] for kind, _ in fields)
    assert [f for f in fields[:3]] == [["float", "x"], ["float", "y"], ["float", "z"]] and len(data) == at + n * size, (fields, n, size, len(data))
    times = -(-MILLION // n)
    body = bytearray(data[at:] * times)
    for k in range(1, times):
        for i in range(k * n, (k + 1) * n):
            # Shifted by 3 µm per copy: different points, the same part.
            x, = struct.unpack_from("<f", body, i * size)
            struct.pack_into("<f", body, i * size, x + 0.003 * k)
    with open(path, "wb") as f:
        f.write(re.sub(r"vertex \d+", f"vertex {n * times:020}", head).encode() + body)
    return n * times


def turns(b, seconds):
    """Rotates the cloud for `seconds`; returns frames a second and the number of points in each frame."""
    b.run("""
      window.drawn = [];
      new MutationObserver(() => window.drawn.push([performance.now(), Number(document.querySelector('[data-shown]').dataset.shown)]))
        .observe(document.querySelector('[data-shown]'), { attributes: true, attributeFilter: ['data-shown', 'data-drawn'] });""")
    x, y, w, h = b.run("const r = document.querySelector('[data-shown] canvas').getBoundingClientRect(); return [r.left, r.top, r.width, r.height]")
    b.mouse({"type": "pointerMove", "duration": 0, "x": round(x + 0.5 * w), "y": round(y + 0.5 * h)}, {"type": "pointerDown", "button": 0})
    # WebDriver sends too few moves. The script sends one before each frame, as a mouse does.
    b.run("""
      const canvas = document.querySelector('[data-shown] canvas'), end = performance.now() + 1000 * arguments[0], [x, y] = [arguments[1], arguments[2]];
      window.turning = true;
      const move = () => {
        const now = performance.now();
        if (now > end) return void (window.turning = false);
        canvas.dispatchEvent(new PointerEvent('pointermove', { clientX: x + 150 * Math.sin(now / 400), clientY: y, buttons: 1, pointerId: 1, bubbles: true }));
        requestAnimationFrame(move);
      };
      move();""", seconds, x + 0.5 * w, y + 0.5 * h)
    b.until("the end of the turn", "return !window.turning")
    b.let_go()
    drawn = b.run("return window.drawn")
    # In the first second the page adapts the number of points to this machine.
    drawn = [d for d in drawn if d[0] > drawn[0][0] + 1000]
    return (len(drawn) - 1) / (drawn[-1][0] - drawn[0][0]) * 1000, [n for _, n in drawn]


def main():
    s = Server(program, folder, "--recordings", folder)
    job = s.job({"procedure": "scan", "recording": "scan"}, 300)
    assert job["state"] == "done", job
    all_ = grown(os.path.join(folder, "station", "jobs", job["id"], "scan", "cloud.ply"))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            b.open(s.url)
            b.ready("station")
            b.page("surface")
            begun = time.time()
            b.click("#three")
            b.until("points", "return document.querySelector('[data-shown]')")
            first = time.time() - begun
            both = lambda: b.run("const e = document.querySelector('[data-shown]'); return [Number(e.dataset.shown), e.querySelector('.read').innerText]")

            def said():
                """The numbers of drawn points and of all points, as the screen states them; checked against the drawn frame."""
                drawn, words = both()
                said = [int(re.sub(r"\D", "", x)) for x in re.match(r"([\d\s]+) of ([\d\s]+) points", words).groups()]
                assert said == [drawn, all_], (words, drawn, all_)
                return said

            print(f"first view after {first:.2f} s with {said()[0]} of {all_} points")
            whole = f"return Number(document.querySelector('[data-shown]').dataset.shown) === {all_}"
            b.until("every point", whole)
            print(f"{said()[0]} of {said()[1]} points after {time.time() - begun:.2f} s")
            rate, numbers = turns(b, 5)
            print(f"turning: {rate:.1f} pictures/s with {min(numbers)} to {max(numbers)} points, {numbers[-1]} at the end of it")
            assert min(numbers) >= 5000 and said()[1] == all_
            b.until("every point again", whole)
            b.drag("[data-shown] canvas", (0.5, 0.5), (0.5, 0.5))
            b.until("a picked point with its sigma", "return /σ 0\\.\\d+/.test(document.querySelector('[data-shown] .read').innerText)")
            quiet(b, "a million points")
        finally:
            b.close()
    s.end()


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
main()
