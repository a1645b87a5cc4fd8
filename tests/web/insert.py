"""In: the program, a folder, names of parts, the cell's speed, the sweep's length (0: the program's choice), and optionally a
folder for screenshots. Out: failure if an operator cannot insert each part in the simulated cell with the real pages in
a real browser. The cell's ground truth decides; clicks and the cell's time are counted.
Frame and unit: mm, s of the cell."""

import os
import sys
import tempfile
import time

import ghost
import plan
import settings
import stalls
import waits
from browser import Browser
from server import Server, events
from shots import quiet, shot

program, folder, parts, speed, sweep = sys.argv[1:6]
pictures = sys.argv[6] if len(sys.argv) > 6 else None
# Pause before a click, s: at the cell's real speed the test clicks as slowly as an operator.
PAUSE = 2.0 if float(speed) == 1 else 0.2
PATIENCE = 600
# Records the longest time between two messages of the page while the button is held.
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
# Records the longest delay of a timer in the page.
KEPT = """
  window.kept = 0;
  let due = performance.now() + 50;
  setInterval(() => { const now = performance.now(); window.kept = Math.max(window.kept, now - due); due = now + 50; }, 50);"""
# The request of a page that mistakes the held button for a new press. The messages of the held button continue.
PRESS = """
  const tab = { 'X-Sheetlight-Tab': sessionStorage.tab };
  return fetch('/api/v1/motion').then((m) => m.json()).then(({ asked: { job, hash } }) =>
    fetch('/api/v1/motion/press', { method: 'POST', headers: tab, body: JSON.stringify({ job, hash }) })).then(async (a) => [a.status, await a.text()]);"""
METER = stalls.Meter()


def stalled(b, why):
    """Discards the trial if the held button's lease ran out because the machine stalled."""
    longest = max(METER.longest, b.run("return window.kept") / 1000)
    if longest > stalls.LONG and "lease ran out" in why:
        raise stalls.Stalled(f"the machine stood still for {longest:.2f} s: {why}")


def step(b, *names):
    """Waits until one of these motions is proposed; fails if the job ends otherwise."""
    script = """
      const ask = document.querySelector('.ask'), problem = document.querySelector('#main .problem')?.innerText;
      if (problem) return 'problem: ' + problem;
      if (document.querySelector('[data-inserted]')) return 'inserted';
      return ask.dataset.moving === 'false' && arguments[0].includes(ask.dataset.step) ? ask.dataset.step : null;"""
    got = b.until(f"one of {names}", script, list(names), seconds=PATIENCE)
    if got not in names:
        stalled(b, got)
    assert got in names, f"{names} were waited for: {got}; the page was silent for {b.run(SILENT)} ms at the longest while the button was down"
    return got


def held(s, b, *names):
    """Holds the button until one of these motions is proposed. Returns the server's longest time without a report of the
    button, ms."""
    time.sleep(PAUSE)
    METER.clear()
    b.run("window.kept = 0")
    b.hold("#send")
    try:
        step(b, *names)
        if names == ("approach",):
            # The button is still held from the scan. A motion at the part needs a new press, whatever the page requests.
            said = b.run(PRESS)
            if said[0] == 200:
                stalled(b, "the held button's lease ran out")
            assert said[0] == 409 and "press it again" in said[1], said
        return s.json("GET", "/motion")["silence_ms"]
    finally:
        b.let_go()


def log():
    """Events since the arm was jogged over the part."""
    all_ = events(folder)
    return all_[max(k for k, e in enumerate(all_) if e["what"] == "jogged"):]


def legs(s):
    """Number of single motions in the motion that waits for confirmation."""
    return s.json("GET", "/motion")["asked"]["motions"]


def insert(s, b, part):
    b.page("station")
    state = s.json("GET", "/motion")
    assert state["armed"] is None and state["asked"] is None, state
    b.clicks, begun = 0, time.time()
    b.page("position")
    time.sleep(PAUSE)
    b.click(f"[data-part={part}]")
    time.sleep(PAUSE)
    b.click("#arm")
    b.until("armed", "return document.querySelector('#arm')?.getAttribute('aria-pressed') === 'true'")
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
    down = legs(s)
    silence.append(held(s, b, "retract"))
    up = legs(s)
    silence.append(held(s, b, "inserted"))
    clicks = b.clicks
    # The cell writes its log asynchronously. The log is complete when it contains the retraction.
    arrivals = lambda part: [e["t_s"] for e in part if e["what"] == "arrived"]
    let_go = lambda: next((k for k, e in enumerate(log()) if e["what"] == "released"), None)
    waits.until("the log to its end", lambda: let_go() and len(arrivals(log()[let_go():])) >= up)
    all_ = log()
    judged = [e for e in all_ if e["what"] == "released"]
    assert len(judged) == 1 and judged[0]["inserted"], judged
    assert not any(e["what"] == "collision" for e in all_), [e for e in all_ if e["what"] == "collision"]
    to_position = arrivals(all_[:let_go()])[-down - 1] - all_[0]["t_s"]
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
        b.until("what was found", "return document.querySelector('.found-pose')")
        shot(b, pictures, "inserted")
    given_back(s)
    # The part is drawn only at a known pose of the arm. If the controller was silent for a second, the request for the
    # outlines is refused; such refusals are ignored here.
    quiet(b, part, refused=1, aside="/ghost?")


def given_back(s):
    """Disarms the robot and releases the lease, so that the next insertion begins as the first did."""
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/robot", {"armed": False})
    s.json("POST", "/lease/release")


def taken_away(s, b):
    """Deletes the halted job, and confirms that somebody has looked at the arm."""
    job = s.json("GET", "/jobs")[0]["id"]
    s.ended(job)
    s.json("POST", "/lease", {"firmly": True})
    s.json("DELETE", f"/jobs/{job}")
    s.json("POST", "/robot/looked")
    given_back(s)
    said = [m for m in b.console() if "status of 4" not in m]
    assert not said, f"a trial that is made again: the console says {said}"


def main():
    s = Server(program, folder, "--simulate", "--set", "none", "--speed", speed)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            b.open(s.url)
            b.ready("station")
            b.run(PULSES)
            b.run(KEPT)
            for part in parts.split(","):
                stalls.again(part, lambda: insert(s, b, part), lambda: taken_away(s, b))
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
