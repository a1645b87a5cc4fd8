"""In: the program, two folders. Out: failure if the robot of a simulated cell moves when it must not: without the lease, for
another motion than the one shown, twice, too early, from another tab, or with the token of an earlier start. Failure if
releasing the button, closing the page, silence, another operator or STOP does not halt the robot, or if a killed server
reports something as done that is not.
Frame and unit: s."""

import contextlib
import json
import os
import socket
import subprocess
import sys
import threading
import time

import stalls
from hands import HELD, Operator
from server import Server, events, say
from waits import PATIENCE, until

program, folder, second = sys.argv[1:4]
METER = stalls.Meter()
RAN_OUT = "lease ran out"


def refused(what, answer):
    status = answer[0] if isinstance(answer, tuple) else answer
    assert 400 <= status < 500, f"{what}: {status}, a 4xx was wanted"


def count(what, where=folder):
    """Number of such events in the cell's log, which is written shortly after the event."""
    time.sleep(0.2)
    return sum(e["what"] == what for e in events(where))


def motions(what):
    """Number of such events in the station's log, which is written before a job continues."""
    with open(os.path.join(folder, "station", "motions.jsonl")) as f:
        return sum(json.loads(line)["event"] == what for line in f)


def why(ended):
    """Why a job ended."""
    return (ended["problem"] or {"what": ""})["what"]


class Late(AssertionError):
    """A time limit was exceeded."""


@contextlib.contextmanager
def judged(ended):
    """Discards a trial as `Stalled` if a time limit was exceeded while the machine stalled; every other failure counts.
    `ended` returns why the job ended."""
    METER.clear()
    try:
        yield
    except AssertionError as e:
        if METER.longest > stalls.LONG and (isinstance(e, Late) or RAN_OUT in ended()):
            raise stalls.Stalled(f"the machine stood still for {METER.longest:.2f} s: {e}") from None
        raise


def nothing_moves(s, former):
    """Tries every forbidden way to start a motion. The controller's log must contain no move."""
    a, b = Operator(s), Operator(s, "other")
    refused("a job before arming", s.ask("POST", "/api/v1/robot", {"armed": True}, tab="other"))
    s.json("POST", "/lease", {"firmly": True})
    unarmed = s.json("POST", "/jobs", {"procedure": "insert", "recipe": "osc"})["id"]
    assert s.ended(unarmed)["problem"]["what"].startswith("the robot is not armed")
    job = a.begin()
    what = a.asked("touch")
    refused("press without the lease", b.post("/motion/press", what))
    refused("press for another motion", a.post("/motion/press", {**what, "hash": "0" * 64}))
    refused("press for another job", a.post("/motion/press", {**what, "job": "0099-insert"}))
    # The requests are correct except for the sender.
    grant = a.press(what)
    time.sleep(HELD)
    for why, other in (("a former start's token", {"token": former}), ("a token that is none", {"token": "0" * 32}), ("no token", {"token": False}), ("a page of another origin", {"Origin": "http://evil.example"}), ("another host's name", {"host": "evil.example"})):
        refused(f"go by {why}", s.ask("POST", "/api/v1/motion/go", {"grant": grant, "what": what}, **other))
        refused(f"press by {why}", s.ask("POST", "/api/v1/motion/press", what, **other))
        refused(f"arm by {why}", s.ask("POST", "/api/v1/robot", {"armed": True}, **other))
    refused("go that nobody pressed for", a.post("/motion/go", {"grant": "0" * 32, "what": what}))
    grant = a.press(what)
    refused("go before it was held", a.post("/motion/go", {"grant": grant, "what": what}))
    grant = a.press(what)
    time.sleep(HELD)
    refused("go for another motion", a.post("/motion/go", {"grant": grant, "what": {**what, "hash": "1" * 64}}))
    refused("go after a wrong try", a.post("/motion/go", {"grant": grant, "what": what}))
    grant = a.press(what)
    time.sleep(HELD)
    refused("go without the lease", b.post("/motion/go", {"grant": grant, "what": what}))
    a.post("/motion/release")
    refused("go after it was let go", a.post("/motion/go", {"grant": grant, "what": what}))
    # A tab that released the lease cannot operate, although no other tab holds the lease and the tab still has the arm.
    assert a.post("/lease/release")[0] == 200
    refused("press after the lease was given back", a.post("/motion/press", what))
    refused("confirming after the lease was given back", a.post("/motion/refuse", what))
    s.json("POST", "/lease", {})
    refused("press of what was armed under a former lease", a.post("/motion/press", what))
    a.post("/robot", {"armed": True})
    # A tab whose name begins like the operator's is a different tab.
    grant = a.press(what)
    time.sleep(HELD)
    s.json("POST", "/lease", {"firmly": True}, tab="tests2")
    s.json("POST", "/lease", {"firmly": True})
    refused("go after a tab of nearly the same name took over", a.post("/motion/go", {"grant": grant, "what": what}))
    a.post("/robot", {"armed": True})
    grant = a.press(what)
    time.sleep(HELD)
    s.json("POST", "/lease", {"firmly": True}, tab="other")
    refused("go after another took over", a.post("/motion/go", {"grant": grant, "what": what}))
    refused("go by the other", b.post("/motion/go", {"grant": grant, "what": what}))
    refused("press by who did not arm", b.post("/motion/press", what))
    s.json("POST", "/lease", {"firmly": True})
    refused("press after somebody else operated, unarmed", a.post("/motion/press", what))
    refused("jogging while a job has the arm", a.post("/simulated", {"holds": "osc"}))
    refused("giving back while a job has the arm", a.post("/robot", {"armed": False}))
    # The operator refuses the motion: the job ends, and nothing has moved.
    a.post("/robot", {"armed": True})
    assert a.post("/motion/refuse", what)[0] == 200
    ended = s.ended(job)
    # The arm has not moved; a resumed job would measure again.
    assert ended["state"] == "failed" and ended["resumable"], ended
    refused("press of a motion of a job that has ended", a.post("/motion/press", what))
    assert count("move") == 0, "something moved"


def halts(s):
    """Each way to end the hold halts the arm. The job states why, and the next motion requires that somebody looks first."""
    a, watcher = Operator(s), Operator(s, "watcher")

    def let_go(grant):
        a.post("/motion/release")

    def silence(grant):
        pass

    def not_mine(grant):
        # Neither another tab with the right grant nor the holder with a wrong grant keeps the button held.
        def talk(mine=a.socket):
            with contextlib.suppress(OSError):
                for _ in range(40):
                    say(watcher.socket, f"held {grant}")
                    say(mine, f"held {'0' * 32}")
                    time.sleep(0.15)
        threading.Thread(target=talk, daemon=True).start()

    def gone(grant):
        # Without the shutdown the server would notice nothing until the next event, because the listener waits in the socket.
        a.socket.shutdown(socket.SHUT_RDWR)
        a.socket.close()

    def taken_over(grant):
        s.json("POST", "/lease", {"firmly": True}, tab="other")

    def stop(grant):
        assert s.ask("POST", "/api/v1/stop", {}, tab="watcher")[0] == 200

    def end_job(grant):
        s.ask("POST", f"/api/v1/jobs/{s.json('GET', '/jobs')[0]['id']}/stop", {}, tab="watcher")

    def trial(how, wanted):
        nonlocal a
        s.json("POST", "/lease", {"firmly": True})
        s.json("POST", "/simulated", {"holds": "osc"})
        before, begun, stopped = count("halt"), motions("begun"), motions("stopped")
        job = a.begin()
        what = a.asked("touch")
        with judged(lambda: why(s.ended(job))):
            grant = a.go(what)
            a.moves(job, grant, folder)
            with a.holding(grant):
                refused("the same again", a.post("/motion/go", {"grant": grant, "what": what}))
                refused("a press while it moves", a.post("/motion/press", what))
            since = time.monotonic()
            how(grant)
            until(f"{how.__name__}: that it halts", lambda: count("halt") != before)
            took = time.monotonic() - since
            if how is gone:
                a = Operator(s)
            ended = s.ended(job)
            assert ended["state"] in ("failed", "stopped") and wanted in why(ended), (how.__name__, ended["problem"])
            assert ended["outcome"] is None and ended["resumable"], ended
            m = s.json("GET", "/motion")
            # After silence, the measured time is one second plus the time until the server notices it and the arm stands.
            assert (1000 if wanted == RAN_OUT else 0) < m["silence_ms"], (how.__name__, m["silence_ms"])
            if took >= 5 or m["silence_ms"] >= 2500:
                raise Late(f"{how.__name__}: halted after {took:.2f} s, not heard for {m['silence_ms']:.0f} ms")
            assert m["look"] and not m["moving"] and m["asked"] is None, m
            assert any("look at the robot" in x for x in s.json("GET", "/bar")["alarms"])
            assert motions("begun") == begun + 1 and motions("stopped") == stopped + 1, "not one motion, begun and stopped"
        print(f"{how.__name__}: halted, seen after {took:.2f} s")
        return ended

    for how, wanted in ((let_go, "let go"), (silence, RAN_OUT), (not_mine, RAN_OUT), (gone, "gone"), (taken_over, "took over"), (stop, "STOP"), (end_job, "STOP")):
        ended = stalls.again(how.__name__, lambda: trial(how, wanted))
    # Nobody has looked at the robot: the next job fails although the robot is armed.
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/robot", {"armed": True})
    moves, begun = count("move"), motions("begun")
    job = s.json("POST", "/jobs", {"procedure": "insert", "recipe": "osc"})["id"]
    assert s.ended(job)["state"] == "failed"
    assert count("move") == moves
    # The halted job can back out; it then reports that nothing was inserted.
    s.json("POST", "/robot/looked")
    s.json("POST", f"/jobs/{ended['id']}/back_out")
    ended = s.ended(ended["id"])
    assert ended["state"] == "failed" and ended["outcome"] is None and "backed out" in ended["problem"]["what"], ended
    assert not ended["resumable"], ended
    assert motions("begun") == begun, "something moved that nobody held the button for"


def killed(former):
    """Server and cell are two programs; the server is killed during a motion. The next start offers the job to be resumed, and
    reports nothing unfinished as done."""
    os.makedirs(second, exist_ok=True)
    log = os.path.join(second, "cell.jsonl")
    cell = subprocess.Popen([program, "--json", "cell", "simulate", "--part", "osc", "--seed", "3", "--robot-port", "0", "--camera-port", "0", "--station", os.path.join(second, "station"), "--log", log], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        text = ""
        while text.count("{") != text.count("}") or not text:
            text += cell.stdout.readline().decode()
        uris = json.loads(text)
        toml = os.path.join(second, "station", "station.toml")
        with open(toml) as f:
            settings = f.read()
        # On two busy cores the threads of the link may be late, so that these limits are longer here.
        with open(toml, "w") as f:
            f.write(settings.replace("max_silence_ms = 400.0", "max_silence_ms = 3000.0").replace("max_still_ms = 300.0", "max_still_ms = 3000.0"))
        more = ("--recordings", second, "--robot", uris["robot"], "--camera", uris["camera"])
        s = Server(program, second, *more)
        s.json("POST", "/lease")
        refused("arming without --allow-motion", s.ask("POST", "/api/v1/robot", {"armed": True}))
        s.end()

        def trial():
            """Kills a server while the arm moves, and starts the next one."""
            at = s = Server(program, second, *more, "--allow-motion")
            a = Operator(s)
            job = a.begin()
            what = a.asked("touch")
            try:
                with judged(lambda: why(at.ended(job))):
                    grant = a.go(what)
                    a.moves(job, grant, second)
                    s.kill()
                    at = Server(program, second, *more, "--allow-motion")
                    cut = at.json("GET", f"/jobs/{job}")
                    assert cut["state"] == "cut_off" and cut["outcome"] is None and cut["resumable"], cut
            except stalls.Stalled:
                at.kill()
                raise
            return s, at, job, grant

        s, again, job, grant = stalls.again("killed", trial)
        refused("the former start's token", again.ask("POST", "/api/v1/motion/go", {"grant": grant, "what": {"job": job, "hash": "0"}}, token=s.token))
        time.sleep(4)
        moves = count("move", second)
        a = Operator(again)
        again.json("POST", "/lease")
        again.json("POST", "/robot", {"armed": True})
        again.json("POST", f"/jobs/{job}/resume")
        a.asked("touch")
        assert count("move", second) == moves, "it moved by itself after the restart"
        assert again.json("GET", f"/jobs/{job}")["state"] == "running"
        again.json("POST", "/stop")
        ended = again.ended(job)
        assert ended["outcome"] is None and ended["state"] in ("stopped", "failed"), ended
        assert again.end() == 0
    finally:
        cell.terminate()
        cell.wait(PATIENCE)


def main():
    former = Server(program, folder, "--simulate", "--set", "none")
    token = former.token
    former.end()
    s = Server(program, folder, "--simulate", "--set", "none")
    nothing_moves(s, token)
    halts(s)
    assert s.end() == 0
    killed(token)


main()
