"""In: the program, a simulated linear axis that carries a board, a browser. Out: failure if the page Calibrate cannot
calibrate the axis from its recording and store it in the station, or if its gauge shows wrong stops.
Frame and unit: counts, mm."""

import json
import math
import os
import sys
import tempfile

from browser import Browser
from server import Server
from shots import quiet

program, folder = sys.argv[1:3]


def widest(counts):
    """The best next stop, computed as the gauge does: a little below the middle of the widest gap."""
    s = sorted(counts)
    gap, low = max((b - a, a) for a, b in zip(s, s[1:]))
    return low + 0.45 * gap


def main():
    with open(os.path.join(folder, "station", "station.toml"), "w") as f:
        f.write('name = "belt"\n')
    camera, axis = (os.path.join(folder, "station", "calibration", f"{k}.json") for k in ("camera", "linear_axis"))
    with open(axis) as f:
        truth = json.load(f)
    os.remove(axis)
    s = Server(program, folder, "--recordings", folder)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            b.open(s.url)
            b.ready("station")
            b.page("calibrate")
            b.click("[data-target=axis]")
            frames = next(r for r in s.json("GET", "/recordings") if r["name"] == "axis")["frames"]
            views = [s.json("GET", f"/view?recording=axis&frame={i}") for i in range(frames)]
            counts = [v["count"] for v in views if v["corners"]]
            assert len(counts) > 5 and all(c is not None for c in counts), counts
            b.until("every stop", "return Number(document.querySelector('[data-stops]')?.dataset.stops) === arguments[0]", len(counts))
            shown = float(b.run("return document.querySelector('[data-next]').dataset.next"))
            assert abs(shown - widest(counts)) <= 1, (shown, widest(counts))
            assert b.run("return document.querySelectorAll('[data-stops] rect.bar').length") == len(counts)
            # What a field of the form says is in the order; a grey picture has the same levels in every channel.
            field = "document.querySelector('[data-input=channel] select')"
            b.until("the form", f"return {field}")
            assert b.run("return [...document.querySelectorAll('[data-input]')].map((e) => e.dataset.input)") == ["channel"]
            assert b.run(f"return [...{field}.options].map((o) => o.text)") == ["luma", "red", "green", "blue"]
            b.run(f"{field}.value = 'green'; {field}.dispatchEvent(new Event('change'))")
            b.click("#calibrate")
            b.until("a verdict", "return document.querySelector('#accept')")
            job = s.json("GET", "/jobs")[0]
            assert job["order"]["channel"] == "green" and job["order"]["leave_out"] == [], job["order"]
            o = job["outcome"]
            assert o["verdict"] in ("good", "usable") and not o["accepted"], o
            assert not os.path.exists(axis), "stored before anybody accepted it"
            b.click("#accept")
            b.until("accepted", "return /accepted/.test(document.getElementById('main').innerText)")
            kinds = {c["kind"]: c["verdict"] for c in s.json("GET", "/station")["calibrations"]}
            assert kinds["linear_axis"] == o["verdict"] and os.path.exists(camera), kinds
            with open(axis) as f:
                found = json.load(f)
            a, w = (x["value"] for x in (found, truth))
            along = lambda v: [v["camera_T_axis"][k] for k in (0, 4, 8)]
            turn = math.degrees(math.acos(min(1, abs(sum(p * q for p, q in zip(along(a), along(w)))))))
            off = abs(a["pitch"] / w["pitch"] - 1)
            print(f"axis: {len(counts)} stops, {o['verdict']}; direction off by {turn:.4f} degrees, pitch by {100 * off:.4f} %")
            assert turn < 0.1 and off < 1e-3, (a, w)
            quiet(b, "axis")
        finally:
            b.close()
    assert s.end() == 0


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
main()
