"""In: the program, a simulated station, its simulated camera, a browser. Out: failure if the page Picture cannot set the
camera, if the found exposure is lost, if the region is ignored, or if the figures of the stripe do not match its pictures.
Frame and unit: px, us, shares of full scale."""

import json
import os
import struct
import subprocess
import sys
import tempfile

import stalls
from browser import Browser
from server import Server, events
from shots import quiet
from waits import PATIENCE, until

program, folder = sys.argv[1:3]
REGION = "extraction.region"


def newest(s):
    """The newest picture: u, v and `fate` of its peaks, its grey levels, its width."""
    while True:
        status, _, b = s.ask("GET", "/api/v1/camera/newest")
        if status == 200:
            break
    _, width, height, peaks = struct.unpack("<4I", b[:16])
    return [struct.unpack("<ffI", b[20 + 12 * k:32 + 12 * k]) for k in range(peaks)], b[20 + 12 * peaks:], width


def exposure(s):
    return next(f for f in s.json("GET", "/camera")["features"] if f["name"] == "ExposureTime")


def by_hand(s):
    """Only the tab with the lease can set the camera, impossible values are refused, and a setting takes effect in the pictures."""
    until("what the camera can be set to", lambda: s.json("GET", "/camera")["features"])
    assert exposure(s)["value"] == 1000 and exposure(s)["unit"] == "us" and exposure(s)["range"] == [1, 1e6], exposure(s)
    ask = lambda name, value: s.ask("PUT", "/api/v1/camera/features", {"name": name, "value": value})[0]
    assert ask("ExposureTime", "300") == 403, "the camera was set by who only watches"
    s.json("POST", "/lease")
    for name, value in (("NoSuchFeature", "1"), ("ExposureTime", "much"), ("ExposureTime", "-3")):
        assert 400 <= ask(name, value) < 500, (name, value)
    peak = lambda: (s.json("GET", "/camera/look")["stripe"] or {"peak": 0})["peak"]
    until("a picture with a stripe", lambda: newest(s)[0])
    before = until("a stripe", peak)
    assert ask("ExposureTime", "100") == 200 and exposure(s)["value"] == 100
    until("darker pictures", lambda: peak() < 0.5 * before)
    s.json("POST", "/lease/release")


def tuned(s, b):
    """Set exposure brings the stripe's peaks into the wanted range, also in later pictures."""
    b.page("picture")
    b.until("the stripe", "return document.querySelector('[data-stripe=seen] .figure')")
    b.click("#set-exposure")
    us = float(b.until("an exposure", "return document.querySelector('[data-tuned]')?.dataset.tuned"))
    job = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "tune")["outcome"]
    low, high = job["look"]["stripe"]["wanted"]
    assert job["exposure_us"] == us and low <= job["look"]["stripe"]["peak"] <= high, job
    assert abs(exposure(s)["value"] - us) < 1e-6 * us, (exposure(s), us)
    until("peaks where they are wanted", lambda: (s.json("GET", "/camera/look")["stripe"] or {"peak": 0})["peak"] > low - 0.08)
    print(f"exposure: {us:.0f} us after {len(job['tried'])} tries, peaks at {100 * job['look']['stripe']['peak']:.0f} %")
    # Manual setting on the page.
    b.until("the field", "return document.querySelector('[data-feature=ExposureTime]')")
    b.run("const e = document.querySelector('[data-feature=ExposureTime]'); e.value = arguments[0]; e.dispatchEvent(new Event('change'))", str(round(us * 0.8)))
    until("what was written into the field", lambda: exposure(s)["value"] == round(us * 0.8))
    quiet(b, "picture")


def lit(b):
    """Set exposure with an armed robot: its controller switches the line laser on and off again, and the bar shows it."""
    cell_folder = os.path.join(folder, "cell")
    os.makedirs(cell_folder)
    cell = subprocess.Popen([program, "--json", "cell", "simulate", "--part", "osc", "--robot-port", "0", "--camera-port", "0", "--station", os.path.join(cell_folder, "station"), "--log", os.path.join(cell_folder, "cell.jsonl")], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        text = ""
        while text.count("{") != text.count("}") or not text:
            text += cell.stdout.readline().decode()
        s = Server(program, cell_folder, "--camera", "sim:3?rate=6&still=0.25", "--robot", json.loads(text)["robot"], "--allow-motion")
        b.open(s.url)
        b.ready("station")
        b.page("settings")
        b.click("#arm")
        b.until("armed", "return document.querySelector('#arm')?.getAttribute('aria-pressed') === 'true'")
        def line():
            """Changes of the laser's output. The program first switches it off once more, so that its state is known."""
            said = [e["on"] for e in events(cell_folder) if e["what"] == "output" and e["number"] == 24]
            return [on for before, on in zip([False] + said, said) if on != before]

        until("a laser that is off", lambda: s.json("GET", "/bar")["laser"] is False)
        assert line() == [], line()
        meter = stalls.Meter()
        tries = 0

        def tune():
            """Sets the exposure; the bar must show that the laser is on. Discards the trial if the machine stalled meanwhile."""
            nonlocal tries
            tries += 1
            b.page("station")
            b.page("picture")
            b.until("the stripe", "return document.querySelector('[data-stripe=seen] .figure')")
            meter.clear()
            b.click("#set-exposure")
            tuned = "return document.querySelector('[data-tuned]')?.dataset.tuned"
            said = until("the laser in the bar, or an exposure", lambda: s.json("GET", "/bar")["laser"] and "on" or b.run(tuned) and "over")
            us = float(b.until("an exposure", tuned))
            until("that the laser is off", lambda: s.json("GET", "/bar")["laser"] is False)
            if said == "over" and meter.longest > stalls.LONG:
                raise stalls.Stalled(f"the machine stood still for {meter.longest:.2f} s")
            assert said == "on", "the bar says nothing of a laser that is on"
            return us

        us = stalls.again("the laser in the bar", tune)
        # Two programs write the bar and the cell's log, so that the log may be later.
        until("the line in the log, on and off once each time", lambda: len(line()) >= 2 * tries)
        assert line() == [True, False] * tries, line()
        job = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "tune")
        low, high = job["outcome"]["look"]["stripe"]["wanted"]
        assert job["outcome"]["exposure_us"] == us and low <= job["outcome"]["look"]["stripe"]["peak"] <= high, job
        assert s.json("GET", "/motion")["armed"], "the robot was given back"
        print(f"exposure with the robot's line: {us:.0f} us after {len(job['outcome']['tried'])} tries")
        quiet(b, "exposure, lit")
        assert s.end() == 0
    finally:
        cell.terminate()
        cell.wait(PATIENCE)


def region(s, b):
    """The stripe is searched only in the drawn region. The region survives a reload and is shown on other screens."""
    peaks = lambda: [p for p in newest(s)[0] if p[2] == 0]
    width = newest(s)[2]
    until("peaks on both sides", lambda: (lambda p: min(x[0] for x in p) < 0.2 * width and max(x[0] for x in p) > 0.8 * width)(peaks() or [(width / 2, 0)]))
    b.click("#region")
    b.until("its grips", "return document.querySelector('[data-grip=\"1,0\"]').checkVisibility()")
    left, top, width_, height_ = b.place("[data-grip='1,0']")
    x, y, far = left + width_ / 2, top + height_ / 2, b.place(".region")[2]
    at = lambda x: {"x": round(x), "y": round(y)}
    b.mouse({"type": "pointerMove", "duration": 0, **at(x)}, {"type": "pointerDown", "button": 0}, {"type": "pointerMove", "duration": 80, **at(x - far / 4)}, {"type": "pointerMove", "duration": 80, **at(x - far / 2)}, {"type": "pointerUp", "button": 0})
    kept = until("a region", lambda: (lambda r: r if r != [0, 0, 1, 1] else None)(s.json("GET", "/settings")["values"][REGION]))
    assert kept[:2] == [0, 0] and kept[3] == 1 and abs(kept[2] - 0.5) < 0.01, kept
    inside = until("peaks in the region alone", lambda: (lambda p: p if p and max(x[0] for x in p) < kept[2] * width else None)(peaks()))
    assert min(x[0] for x in inside) < 0.2 * width, "the region took what it should have left"
    # The page continues with the stored region after the server's answer.
    b.until("that it was kept", "return document.querySelector('.region').dataset.saved")
    # With the keyboard: an arrow key moves an edge by a hundredth of the picture.
    b.run("document.querySelector('[data-grip=\"-1,0\"]').focus()")
    b.keys("\ue014")
    until("an edge that was moved by an arrow", lambda: abs(s.json("GET", "/settings")["values"][REGION][0] - 0.01) < 1e-6)
    b.reload("picture")
    b.until("the region again", "return !document.querySelector('.region').hidden")
    b.click("#region-whole")
    until("the whole picture", lambda: s.json("GET", "/settings")["values"][REGION] == [0, 0, 1, 1] and max(x[0] for x in peaks() or [(0,)]) > 0.8 * width)
    ask = lambda value: s.ask("PUT", "/api/v1/settings", {"sha256": s.json("GET", "/settings")["sha256"], "changes": {REGION: value}})[0]
    for wrong in ([0.5, 0, 0.4, 1], [0, 0, 1.2, 1], [0, 0, 0.5, 0.001], [0, 0, 1]):
        assert 400 <= ask(wrong) < 500, wrong
    quiet(b, "region")


def pointed(s, b):
    """The pixel shown for the centre of the map is the centre of the picture. Returns the device pixel ratio."""
    _, grey, width = newest(s)
    height = len(grey) // width
    left, top, wide, high = b.place(".map canvas")
    b.mouse({"type": "pointerMove", "duration": 0, "x": round(left + wide / 2), "y": round(top + high / 2)})
    read = b.until("what stands there", "return document.querySelector('.map .read').textContent.match(/u (\\d+) +v (\\d+) +(\\d+)/)")
    # Tolerance: the mouse is placed to one CSS pixel, and the picture fills 0.97 of the box.
    off = [abs(int(read[1]) + 0.5 - width / 2), abs(int(read[2]) + 0.5 - height / 2)]
    assert max(off) <= 1 + 1.1 * max(width / wide, height / high), (read, width, height, wide, high)
    sharp = b.run("const c = document.querySelector('.map canvas'), r = c.getBoundingClientRect(); return [c.width / r.width, c.height / r.height, devicePixelRatio]")
    assert abs(sharp[0] / sharp[2] - 1) < 0.01 and abs(sharp[1] / sharp[2] - 1) < 0.01, sharp
    return sharp[2]


def recorded(s, b):
    """The figures of the stripe are also shown for a picture of a recording."""
    b.run("const e = document.querySelector('.head select'); e.value = 'scan'; e.dispatchEvent(new Event('change'))")
    look = s.json("GET", "/look?recording=scan&frame=30")
    stripe = look["stripe"]
    assert stripe["lying"] and 1.5 < stripe["width_px"] < 12 and len(stripe["pieces"]) == 32, stripe
    assert abs(sum(p[3] for p in stripe["pieces"]) / 32 - stripe["dark"]) < 0.02, stripe
    b.until("the stripe of the recording", "return document.querySelectorAll('.along polyline').length === 3")
    assert s.ask("GET", "/api/v1/look?recording=scan&frame=3000")[0] == 404
    assert s.ask("GET", "/api/v1/look?recording=../scan&frame=0")[0] in (400, 403, 404)
    quiet(b, "recorded")


s = Server(program, folder, "--recordings", folder, "--camera", "sim:3?rate=6&still=0.25")
by_hand(s)
if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
    b = Browser(profile)
    try:
        b.open(s.url)
        b.ready("station")
        tuned(s, b)
        assert pointed(s, b) == 1
        region(s, b)
        recorded(s, b)
        # Leaves the page, so that it sends no requests after the server has ended.
        b.open("about:blank")
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as other:
            fine = Browser(other, flags=("--force-device-scale-factor=2",))
            try:
                fine.open(s.url)
                fine.ready("station")
                fine.page("picture")
                fine.until("a picture", "return document.querySelector('.map')?.dataset.number")
                assert pointed(s, fine) == 2
                # The other browser still holds the lease.
                fine.click("#lease")
                fine.until("the lease", "return document.querySelector('#lease').getAttribute('aria-pressed') === 'true'")
                region(s, fine)
                fine.open("about:blank")
            finally:
                fine.close()
        assert s.end() == 0
        b.console()
        lit(b)
    finally:
        b.close()
