"""In: the program, a simulated station, browsers. Out: failure if an old browser without WebGL2 shows nothing in place of
the 3-D view, or if a page does not report a full disk together with a remedy.
Frame and unit: none."""

import sys
import tempfile

import waits
from browser import Browser
from server import Server
from shots import quiet

program, folder = sys.argv[1:3]
# File operations after which the disk is full. A start needs fewer, a scan more.
ROOM = 24


def old_browser(url, scanned):
    """Without WebGL and WebGL2 the page says that there is no 3-D view, and the map still works."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile, flags=("--disable-3d-apis",))
        try:
            b.open(url)
            b.ready("station")
            assert b.run("return document.createElement('canvas').getContext('webgl2') === null"), "this browser is none of the old ones"
            for page in (f"surface?job={scanned}", "position"):
                b.run("location.hash = arguments[0]", f"#/{page}")
                b.ready(page.split("?")[0])
                b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
                b.click("#three")
                b.until("that there is no WebGL2", "return /no WebGL2/.test(document.getElementById('main').innerText)")
            b.page("surface")
            b.until("the map again", "return document.querySelector('.map canvas')?.width > 300")
            # The browser's own messages about missing WebGL are not faults of the page.
            said = [m for m in b.console() if "WebGL" not in m and "GPU" not in m]
            assert not said, said
        finally:
            b.close()


def full_disk():
    """If the disk is full while a scan writes, the page Scan reports it in words that an operator understands."""
    s = Server(program, folder, "--recordings", folder, env={"SHEETLIGHT_FULL_AT": str(ROOM)})
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            b.open(s.url)
            b.ready("station")
            former = s.json("GET", "/jobs")[0]["id"]
            b.page("scan")
            b.click("#start")
            ends = lambda: [j["state"] for j in s.json("GET", "/jobs")[:1] if j["id"] != former]
            waits.until("the end of the scan", lambda: b.text("#main .problem") or ends() == ["done"])
            if not (said := b.text("#main .problem")):
                print("this build knows no full disks: a release")
                return
            assert "the disk is full" in said and "take old jobs away on the page Replay" in said and "--out" not in said, said
            quiet(b, "full disk", refused=0)
        finally:
            b.close()
            s.kill()


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
s = Server(program, folder, "--recordings", folder)
job = s.job({"procedure": "scan", "recording": "scan"})
assert job["state"] == "done", job
assert s.job({"procedure": "find", "scans": [job["id"]], "recipe": "led"})["state"] == "done"
s.json("POST", "/lease/release")
old_browser(s.url, job["id"])
assert s.end() == 0
full_disk()
