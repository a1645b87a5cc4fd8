"""In: the program, a folder, and optionally a folder for screenshots. Out: failure if an operator cannot calibrate the
simulated cell from nothing to "good" with the real pages in a real browser.
Frame and unit: mm, s of the cell."""

import os
import shutil
import sys
import tempfile
import time

from browser import Browser
from server import Server, events
from shots import quiet, shot

program, folder = sys.argv[1:3]
pictures = sys.argv[3] if len(sys.argv) > 3 else None
PAUSE, MOST_CLICKS, MOST_S = 2.0, 12, 300


def ended(b):
    """The end of the calibration: "good", or the text of the problem that stopped it; None while it runs."""
    return b.run("return document.querySelector('#main .problem')?.innerText ?? (document.querySelector('#accept') && 'good')")


def main():
    s = Server(program, folder, "--simulate", "--set", "none")
    shutil.rmtree(os.path.join(folder, "station", "calibration"))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            b.open(s.url)
            b.ready("station")
            b.clicks, begun = 0, time.time()
            for press in ("#nav a[href='#/calibrate']", "[data-target=auto]", "#over-board", "#arm"):
                b.click(press)
                time.sleep(PAUSE)
            b.until("armed", "return document.querySelector('#arm')?.getAttribute('aria-pressed') === 'true'")
            before = len(events(folder))
            b.click("#auto")
            b.until("the first motion", "return document.querySelector('.ask').dataset.step === 'calibrate'")
            time.sleep(PAUSE)
            b.hold("#send")
            shown = False
            try:
                while not (said := ended(b)):
                    time.sleep(0.3)
                    if not shown and b.run("return Number(document.querySelector('[data-expected]')?.dataset.expected ?? 9) < 0.2"):
                        shown = True
                        b.run("document.querySelector('.thumb svg')?.scrollIntoView({ block: 'end' })")
                        shot(b, pictures, "auto")
                    assert time.time() - begun < 1800, b.text("#main")[:2000]
            finally:
                b.let_go()
            assert said == "good", said
            log = events(folder)[before:]
            took = log[-1]["t_s"] - log[0]["t_s"]
            assert b.run("return !document.querySelector('#accept').disabled"), b.text("#main")[:2000]
            b.click("#accept")
            b.until("accepted", "return /accepted/.test(document.getElementById('main').innerText)")
            job = s.json("GET", "/jobs")[0]
            o = job["outcome"]
            print(f"{o['verdict']}: expected {o['figures'].get('expected_error_mm')} mm; {b.clicks} clicks, {took:.1f} s of the cell, {time.time() - begun:.1f} s in all; {o['reasons']}")
            kinds = {c["kind"]: c["verdict"] for c in s.json("GET", "/station")["calibrations"]}
            assert len(kinds) >= 4 and set(kinds.values()) == {"good"}, kinds
            assert b.clicks <= MOST_CLICKS, f"{b.clicks} clicks"
            assert took <= MOST_S, f"{took} s of the cell"
            quiet(b, "calibrate")
        finally:
            b.close()
            print("".join(s.said)[-2000:])
            s.end()


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
main()
