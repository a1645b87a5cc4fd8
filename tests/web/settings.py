"""In: the screen with a station or a simulated cell, and a browser that shows the screen. Out: failure if a setting gets
another value than requested, a comment or a calibration is lost, a backup cannot be restored, or an output is switched
without a press.
Frame and unit: as the settings."""

import json
import os
import subprocess

import stalls
import waits
from shots import quiet


def text(s):
    with open(os.path.join(s.json("GET", "/settings")["folder"], "station.toml")) as f:
        return f.read()


def change(b, name, value):
    b.run("const e = document.querySelector(`[data-setting='${arguments[0]}']`); e.value = arguments[1]; e.dispatchEvent(new Event(e.tagName === 'SELECT' ? 'change' : 'input'))", name, value)


def settings(program, s, b, shot):
    """Changes notation and tolerance through fields, enters a broken text by hand, restores a backup."""
    first = "# by the window\n" + text(s)
    with open(os.path.join(s.station, "station.toml"), "w") as f:
        f.write(first)
    b.page("station")
    b.page("settings")
    b.until("the fields", "return document.querySelector('[data-setting=tolerance_mm]')")
    assert b.run("return document.querySelector('#save-settings').disabled"), "nothing was changed yet"
    change(b, "robot", "ur")
    change(b, "tolerance_mm", "0.08")
    b.click("#save-settings")
    b.until("saved", "return /Saved/.test(document.querySelector('.head').innerText)")
    now = text(s)
    assert now.startswith("# by the window\n") and 'robot = "ur"' in now and "tolerance_mm = 0.08" in now, now
    assert s.json("GET", "/station")["robot"] == "ur" and s.json("GET", "/bar")["station"] == "cell 3"
    shot(b, "settings")
    # An invalid setting is reported, and nothing is changed.
    b.run("const e = document.querySelector('textarea'); e.value = e.value.replace('robot', 'robbot')")
    b.click("#save-text")
    b.until("the line of a broken setting", "return /robbot/.test(document.querySelector('#main .problem')?.innerText ?? '')")
    assert text(s) == now
    # An editor has changed the file meanwhile. The change of the page would undo that, so that it is refused.
    with open(os.path.join(s.station, "station.toml"), "a") as f:
        f.write("# later\n")
    change(b, "tolerance_mm", "0.5")
    b.click("#save-settings")
    b.until("that the file is another one", "return /changed since this page/.test(document.querySelector('#main .problem')?.innerText ?? '')")
    assert text(s) == now + "# later\n"
    # The backup from before the first change is restored with its calibrations. The replaced state becomes a backup too.
    kept = [k for k in s.json("GET", "/settings")["backups"] if "settings" in k["name"]]
    assert len(kept) == 1 and kept[0]["files"] >= 3, kept
    status, _, data = s.ask("GET", f"/api/v1/backups/{kept[0]['name']}")
    assert status == 200 and json.loads(data)["files"]["station.toml"] == first
    calibration = os.path.join(s.station, "calibration", "camera.json")
    with open(calibration, "rb") as f:
        camera = f.read()
    os.remove(calibration)
    b.page("station")
    b.page("settings")
    b.click(".restore")
    b.until("the question", "return document.querySelector('.restore').innerText === 'Really restore?'")
    assert text(s) == now + "# later\n", "it came back without being asked for twice"
    b.click(".restore")
    b.until("restored", "return /Restored/.test(document.querySelector('.head').innerText)")
    assert text(s) == first
    with open(calibration, "rb") as f:
        assert f.read() == camera
    names = [k["name"] for k in s.json("GET", "/settings")["backups"]]
    assert sum("settings" in n or "restore" in n for n in names) == 2, "the state before the restore is a backup, once"
    assert s.json("GET", "/jobs"), "jobs stay"
    for trick in ("..%2f..%2fstation.toml", "%2e%2e", "no-such.json"):
        assert s.ask("GET", f"/api/v1/backups/{trick}")[0] in (400, 404), trick
    # The command line does the same.
    run = lambda *words: subprocess.run([program, "--quiet", "station", *words, "--station", s.station], capture_output=True)
    out = os.path.join(os.path.dirname(s.station), "kept.json")
    assert run("backup", "--out", out).returncode == 0
    done = run("set", "robot=kuka", "tolerance_mm=")
    assert done.returncode == 0 and 'robot = "kuka"' in text(s), done.stderr
    assert run("set", "robot=none such").returncode != 0 and 'robot = "kuka"' in text(s)
    assert run("restore", out).returncode == 0 and text(s) == first
    b.page("station")
    quiet(b, "settings", refused=2)


def outputs(s, b, events):
    """A press switches an armed robot's line laser on for a moment, and no other laser. The gripper opens only at the second press."""
    b.page("settings")
    b.until("outputs", "return document.querySelector('[data-output=line]')")
    assert b.run("return document.querySelector('[data-output=line]').disabled"), "outputs can be tried without arming"
    refused = s.ask("POST", "/api/v1/robot/output", {"output": "line"})
    assert refused[0] in (403, 409), refused
    before = len(events())
    b.click("#arm")
    meter = stalls.Meter()
    presses = 0

    def lit():
        """Switches the line laser on for 1.5 s; the bar must show it. Discards the trial if the machine stalled meanwhile."""
        nonlocal presses
        presses += 1
        meter.clear()
        b.click("[data-output=line]")
        over = lambda: b.run("return /was switched/.test(document.getElementById('main').innerText)")
        said = waits.until("a laser that is on, or was", lambda: s.json("GET", "/bar")["laser"] and "on" or over() and "was")
        if said == "was" and meter.longest > stalls.LONG:
            raise stalls.Stalled(f"the machine stood still for {meter.longest:.2f} s")
        assert said == "on", "the bar says nothing of a laser that is on"
        waits.until("that it was switched", over)

    def seen_anew():
        b.page("station")
        b.page("settings")

    stalls.again("the line", lit, seen_anew)
    b.click("[data-output=open]")
    b.until("the question", "return document.querySelector('[data-output=open]').innerText.includes('drop')")

    def switched():
        """Changes of the line laser's output; the other laser stays off. Both are also switched off before and after a try."""
        said = [(e["number"], e["on"]) for e in events()[before:] if e["what"] == "output"]
        assert (25, True) not in said, said
        line = [on for number, on in said if number == 24]
        return [on for former, on in zip([False] + line, line) if on != former]

    waits.until("the line's end in the cell's log", lambda: len(switched()) >= 2 * presses)
    assert switched() == [True, False] * presses, switched()
    # While the robot is armed, settings cannot be saved: its limits were read when it was armed.
    before = text(s)
    change(b, "motion.speed_mm_s", "20")
    b.click("#save-settings")
    b.until("that the robot is armed", "return /robot is armed/.test(document.querySelector('#main .problem')?.innerText ?? '')")
    assert text(s) == before
    b.click("#arm")
    b.until("given back", "return document.querySelector('#arm')?.getAttribute('aria-pressed') === 'false'")
    change(b, "motion.speed_mm_s", "45")
    b.click("#save-settings")
    b.until("saved", "return /Saved/.test(document.querySelector('.head').innerText)")
    assert "speed_mm_s = 45" in text(s), text(s)
    for name, value in (("max_turn_deg_s", "20"), ("max_still_ms", "2500")):
        change(b, f"motion.{name}", value)
        b.click("#save-settings")
        b.until("saved", "return /Saved/.test(document.querySelector('.head').innerText) && document.querySelector('#save-settings').disabled")
        assert f"{name} = {value}" in text(s), text(s)
    quiet(b, "outputs", refused=1)
