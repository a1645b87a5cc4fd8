"""In: the program, a simulated station, its scan's pictures as raw frames on standard input at 25 a second. Out: failure
if the newest picture is not shown with its peaks, if a skipped picture is not counted, or if two viewers slow the server.
Frame and unit: px, ms, pictures a second."""

import glob
import os
import struct
import subprocess
import sys
import threading
import time

from raw import grey
from recordings import longer
from server import Server
from waits import PATIENCE, until

program, folder = sys.argv[1:3]
RATE, SECONDS = 25, 4
# Least number of pictures that each viewer gets, also on a slow machine.
LEAST = 11


names = sorted(glob.glob(os.path.join(folder, "scan", "laser_*.png")))[20:28]
frames = [grey(n) for n in names]
assert frames and len(frames[0]) == 640 * 480
s = Server(program, folder, "--recordings", folder, "--camera", "-", "--raw", "640x480:gray8", stdin=subprocess.PIPE)
sent = 0


def feed():
    global sent
    begun = time.time()
    while time.time() - begun < SECONDS or (min(map(len, seen.values())) < LEAST and time.time() - begun < PATIENCE):
        s.process.stdin.write(frames[sent % len(frames)])
        s.process.stdin.flush()
        sent += 1
        time.sleep(max(0.0, begun + sent / RATE - time.time()))
    s.process.stdin.close()
    fed.set()


seen, fed = {0: [], 1: []}, threading.Event()


def look(who):
    """Does what a page does: asks for a newer picture than the one it shows."""
    number = 0
    while not fed.is_set():
        status, _, b = s.ask("GET", f"/api/v1/camera/newest?after={number}", tab=f"look{who}")
        if status == 204:
            continue
        assert status == 200, (status, b[:200])
        number, width, height, peaks, delay = struct.unpack("<4If", b[:20])
        assert (width, height) == (640, 480) and len(b) == 20 + 12 * peaks + 640 * 480
        u, v, fate = struct.unpack("<ffI", b[20:32]) if peaks else (0, 0, 0)
        assert 0 <= u < 640 and 0 <= v < 480 and fate < 10
        assert b[20 + 12 * peaks:] in frames, "another picture than any that was sent"
        seen[who].append((number, peaks, delay))


def accounted(bar):
    """Every picture is counted as measured or dropped; one may still be in progress."""
    count = bar["frames"]
    return abs(count["measured"] + sum(count["dropped"].values()) - count["seen"]) <= 1


threads = [threading.Thread(target=feed), *(threading.Thread(target=look, args=(k,)) for k in seen)]
[t.start() for t in threads]
[t.join() for t in threads]
# The camera's end is reported after all sent pictures, together with their counts.
bar = until("the camera's end", lambda: (lambda bar: bar if any("ended" in a for a in bar["alarms"]) and accounted(bar) else None)(s.json("GET", "/bar")))
assert bar["mode"] == "live", bar
count = bar["frames"]
for who in seen:
    numbers = [n for n, _, _ in seen[who]]
    assert len(numbers) >= LEAST and numbers == sorted(set(numbers)), f"{who}: {len(numbers)} pictures, newest first"
    # The stage learns the stripe from the first pictures.
    assert all(p > 100 for _, p, _ in seen[who][3:]), [p for _, p, _ in seen[who]]
over = count["dropped"].get("skipped: a newer one came", 0)
assert count["seen"] == sent, (count, sent)
print(f"{sent} pictures at {RATE}/s to two that look on: {[len(seen[k]) for k in seen]} shown, {over} passed over, delay p50/p99 {bar['delay_ms']} ms")
s.end()

# A job has priority: while it runs, pictures that nobody requests are not measured, but counted. A viewer that asks still
# gets a new picture.
s = Server(program, folder, "--recordings", folder, "--camera", "sim:3?rate=8")
unlooked = lambda: s.json("GET", "/bar")["frames"]["dropped"].get("nobody looked while a job ran", 0)
until("pictures", lambda: s.json("GET", "/bar")["frames"]["measured"] >= 3)
assert unlooked() == 0, "a picture was left out while no job ran"
s.json("POST", "/lease")
# Long enough that some pictures of the camera arrive during the scan.
scan = {"procedure": "scan", "recording": longer(folder, 4)}
assert s.job(scan)["state"] == "done"
# A viewer requests pictures during the next scan.
before = unlooked()
assert before > 0, s.json("GET", "/bar")["frames"]
job = s.json("POST", "/jobs", scan)["id"]
numbers = []
while s.json("GET", f"/jobs/{job}")["state"] in ("queued", "running"):
    status, _, b = s.ask("GET", f"/api/v1/camera/newest?after={numbers[-1] if numbers else 0}")
    numbers += [struct.unpack("<I", b[:4])[0]] if status == 200 else []
assert len(numbers) > 1 and numbers == sorted(set(numbers)), numbers
until("the account", lambda: accounted(s.json("GET", "/bar")))
print(f"while scans ran: {before} pictures that nobody looked at left out, then {len(numbers)} shown")
assert s.end() == 0
