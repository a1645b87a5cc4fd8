"""In: the program, a folder with a simulated station of 1280x960 and its scan. Out: printed figures of a busy screen: the
speed of a scan alone, beside a camera of 30 pictures a second, and with two browsers that show the camera; the age of the
pictures that the browsers show. Failure only for what does not depend on speed: an outdated or an uncounted picture.
Frame and unit: px, ms, pictures and shots a second."""

import glob
import os
import statistics
import subprocess
import sys
import tempfile
import time

from browser import Browser
from raw import Feed, grey
from server import Server
from shots import quiet

program, folder = sys.argv[1:3]
RATE, ROUNDS, SIZE = 30, 10, (1280, 960)
# Pause before each scan, s, with and without viewers: a page is completely drawn by then.
SETTLES = 1.5
# Composes pages as a browser on a machine without a GPU does. The browser of the other tests uses WebGL in software.
PLAIN = ("--disable-gpu-compositing",)

# Records when each picture is drawn. The number of a picture is in its first four pixels.
WATCH = """
  window.seen = [];
  let last = -1;
  const asks = window.fetch;
  window.fetch = async (...a) => {
    const answer = await asks(...a);
    if (!String(a[0]).includes('/camera/newest') || answer.status !== 200) return answer;
    const bytes = await answer.arrayBuffer(), at = 20 + 12 * new Uint32Array(bytes, 0, 4)[3];
    last = new DataView(bytes, at, 4).getUint32(0, true);
    return new Response(bytes, { status: 200, headers: answer.headers });
  };
  const box = document.querySelector('.map');
  new MutationObserver(() => { const n = last; requestAnimationFrame(() => window.seen.push([Date.now(), n])); }).observe(box, { attributes: true, attributeFilter: ['data-number'] });"""


def scan(s):
    """Runs a scan and returns its shots a second."""
    time.sleep(SETTLES)
    job = s.job({"procedure": "scan", "recording": "scan"}, 300)
    assert job["state"] == "done", job
    s.json("DELETE", f"/jobs/{job['id']}")
    return job["outcome"]["shots_per_second"]


def share(values, q):
    return sorted(values)[round((len(values) - 1) * q)]


def look_on(s, browsers):
    for b in browsers:
        b.open(s.url)
        b.ready("station")
        b.page("picture")
        b.until("a picture", "return document.querySelector('.map')?.dataset.number")
        b.run(WATCH)


def turn_away(browsers, seen):
    """Stores what each browser has shown, then opens an empty page."""
    for k, b in enumerate(browsers):
        seen[k].append(b.run("return window.seen"))
        quiet(b, f"browser {k}")
        b.open("about:blank")


def main():
    names = sorted(glob.glob(os.path.join(folder, "scan", "laser_*.png")))
    frames = [grey(n) for n in names[len(names) // 2:][:6]]
    assert all(len(f) == SIZE[0] * SIZE[1] for f in frames)
    s = Server(program, folder, "--recordings", folder, "--camera", "-", "--raw", f"{SIZE[0]}x{SIZE[1]}:gray8", stdin=subprocess.PIPE)
    feed = Feed(s.process.stdin, frames, RATE)
    scan(s)
    # The cases alternate, because the load of the machine varies more from minute to minute than the differences measured here.
    rounds, seen = [], [[], []]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as one, tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as two:
        browsers = [Browser(one, flags=PLAIN), Browser(two, flags=PLAIN)]
        try:
            for n in range(ROUNDS):
                feed.rest(True)
                alone = scan(s)
                feed.rest(False)
                camera = scan(s)
                look_on(s, browsers)
                looked = scan(s)
                turn_away(browsers, seen)
                rounds.append((alone, camera, looked))
                print(f"round {n}: alone {alone:.0f} shots/s, a camera of {RATE}/s {camera:.0f}, two browsers look on {looked:.0f}", flush=True)
        finally:
            for b in browsers:
                b.close()
    for what, k, of in (("a camera alone", 1, 0), ("two browsers and it", 2, 0), ("of these the browsers", 2, 1)):
        ratios = [r[k] / r[of] for r in rounds]
        print(f"{what}: {100 * (1 - statistics.median(ratios)):.0f} % fewer shots/s ({', '.join(f'{100 * (1 - q):.0f}' for q in ratios)})")
    for k, runs in enumerate(seen):
        for shown in runs:
            numbers = [n for _, n in shown]
            assert len(shown) > 1 and numbers == sorted(set(numbers)), f"browser {k}: {numbers[:20]}: newest first, each once"
        ages = [at - 1000 * feed.sent[n] for shown in runs for at, n in shown if n < len(feed.sent)]
        print(f"browser {k}: {len(ages)} pictures, age when drawn p50 {share(ages, 0.5):.0f} ms, p99 {share(ages, 0.99):.0f} ms")
    feed.end()
    count = s.json("GET", "/bar")["frames"]
    over = sum(count["dropped"].values())
    print(f"{len(feed.sent)} sent, {count['seen']} seen, {count['measured']} measured, {over} dropped by cause: {count['dropped']}")
    assert abs(count["seen"] - len(feed.sent)) <= 1 and abs(count["measured"] + over - count["seen"]) <= 2, (count, len(feed.sent))
    s.end()


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
main()
