"""In: the program, a folder, parts. Out: failure where an operator cannot insert each of them in the simulated cell through the real
pages in a real browser, judged by the cell's truth. Clicks and the cell's time are counted. A fourth argument is the cell's speed, a
fifth the sweep (0: the program's own), a sixth a folder for the pages' pictures.
Frame and unit: mm, s of the cell."""

import os
import sys
import tempfile
import time

import ghost
import plan
import settings
from browser import Browser
from server import Server, events
from shots import quiet, shot

program, folder, parts, speed, sweep = sys.argv[1:6]
pictures = sys.argv[6] if len(sys.argv) > 6 else None
# At the cell's own pace an operator takes his time over each click.
PAUSE = 2.0 if float(speed) == 1 else 0.2
PATIENCE = 600
# Notes the longest time between two pulses of the page while the button is down.
PULSES = """
  window.silent = 0;
  let last = 0;
  const say = WebSocket.prototype.send;
  WebSocket.prototype.send = function (text) {
    const now = performance.now();
    if (last) window.silent = Math.max(window.silent, now - last);
    last = now;
    return say.call(this, text);
  };
  addEventListener('pointerup', () => (last = 0), true);"""
SILENT = "return Math.round(window.silent)"
# What a page would say that takes the held button for a new press.
PRESS = """
  const ask = new XMLHttpRequest(), m = new XMLHttpRequest();
  m.open('GET', '/api/v1/motion', false);
  m.send();
  const { job, hash } = JSON.parse(m.responseText).asked;
  ask.open('POST', '/api/v1/motion/press', false);
  ask.setRequestHeader('X-Sheetlight-Tab', sessionStorage.tab);
  ask.send(JSON.stringify({ job, hash }));
  return [ask.status, ask.responseText];"""


def step(b, *names):
    """Waits until a motion of one of these names is asked for, or the job ended otherwise."""
    script = """
      const ask = document.querySelector('.ask'), problem = document.querySelector('#main .problem')?.innerText;
      if (problem) return 'problem: ' + problem;
      if (document.querySelector('[data-inserted]')) return 'inserted';
      return ask.dataset.moving === 'false' && arguments[0].includes(ask.dataset.step) ? ask.dataset.step : null;"""
    got = b.until(f"one of {names}", script, PATIENCE, list(names))
    assert got in names, f"{names} were waited for: {got}; the page was silent for {b.run(SILENT)} ms at the longest while the button was down"
    return got


def held(s, b, *names):
    """Holds the button until one of these is asked for; gives the longest that the server heard nothing of it, ms."""
    time.sleep(PAUSE)
    b.hold("#send")
    try:
        step(b, *names)
        if names == ("approach",):
            # Still down from what only looked: at the part the button is pressed anew, whatever a page says.
            said = b.run(PRESS)
            assert said[0] == 409 and "pressed anew" in said[1], said
        return s.json("GET", "/motion")["silence_ms"]
    finally:
        b.let_go()


def insert(s, b, part):
    b.page("station")
    state = s.json("GET", "/motion")
    assert state["armed"] is None and state["asked"] is None, state
    before, b.clicks, begun = len(events(folder)), 0, time.time()
    b.page("position")
    time.sleep(PAUSE)
    b.click(f"[data-part={part}]")
    time.sleep(PAUSE)
    b.click("#arm")
    b.until("armed", "return document.querySelector('#arm')?.getAttribute('aria-pressed') === 'true'", 20)
    if float(sweep):
        b.run("document.querySelector('#sweep').value = arguments[0]", sweep)
    time.sleep(PAUSE)
    b.click("#insert")
    step(b, "touch")
    if part == "osc":
        shot(b, pictures, "ask")
    silence = [held(s, b, "approach")]
    asks = ghost.lies_on_the_part(s, b)
    if part == "osc":
        shot(b, pictures, "ghost")
    ghost.as_on_the_command_line(program, folder if os.path.isdir(os.path.join(folder, "jobs")) else os.path.join(folder, "station"), asks)
    silence.append(held(s, b, "insert"))
    time.sleep(0.3)
    log = events(folder)[before:]
    to_position = [e for e in log if e["what"] == "arrived"][-1]["t_s"] - log[0]["t_s"]
    silence += [held(s, b, "retract"), held(s, b, "inserted")]
    clicks = b.clicks
    time.sleep(0.3)
    log = events(folder)[before:]
    judged = [e for e in log if e["what"] == "released"]
    assert len(judged) == 1 and judged[0]["inserted"], judged
    assert not any(e["what"] == "collision" for e in log), [e for e in log if e["what"] == "collision"]
    job = s.json("GET", "/jobs")[0]
    assert job["state"] == "done" and job["outcome"]["confirmations"] == 5, job["state"]
    print(
        f"{part}: inserted {judged[0]['lateral_mm']:.3f} mm aside, {judged[0]['turn_deg']:.3f} degrees; {clicks} clicks, position after "
        f"{to_position:.1f} s of the cell ({job['outcome']['time_to_position_s']:.1f} s of this machine), {time.time() - begun:.1f} s in all; the held button was not heard for {max(silence):.0f} ms at the longest (limit 1000), the page was silent for {b.run(SILENT)}"
    )
    assert clicks <= 8, f"{clicks} clicks"
    if float(sweep):
        shown = plan.as_the_job(program, s, job, sweep)
        print(f"the sweep is the plan's: {shown['shots']} shots, {shown['along_mm']:.1f} and {shown['across_mm']:.1f} mm left beside the part, {shown['box_mm']:.0f} mm to the box")
    if float(speed) == 1:
        assert to_position <= 120, f"{to_position} s of the cell"
    if part == "osc":
        b.click("#to-found")
        b.until("what was found", "return document.querySelector('.found-pose')", 20)
        shot(b, pictures, "inserted")
    # The arm is given back: the next one begins as the first did.
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/robot", {"armed": False})
    s.json("POST", "/lease/release")
    quiet(b, part, refused=1)


def main():
    s = Server(program, folder, "--simulate", "--set", "none", "--speed", speed)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            b.open(s.url)
            b.ready("station")
            b.run(PULSES)
            for part in parts.split(","):
                insert(s, b, part)
            plan.drawn(s, b, "osc")
            settings.outputs(s, b, lambda: events(folder))
        finally:
            b.close()
            print("".join(s.said)[-2000:])
            assert s.end() == 0


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
main()
