"""In: a server. Out: a tab that operates it as a page does: it arms, orders, holds the button of a motion and releases it.
Frame and unit: s."""

import contextlib
import json
import threading
import time

from server import events, frame, say
from waits import until

HELD = 0.9


def moving(where):
    """Whether the arm of the simulated cell moves now, by the log in this folder."""
    log = events(where)
    last = [e["what"] for e in log if e["what"] in ("move", "arrived", "halt")]
    return bool(last) and last[-1] == "move"


class Operator:
    """A tab with its socket, which acts as a page does."""

    def __init__(self, s, tab="tests", session=None):
        self.s, self.tab = s, tab
        status, self.socket = s.socket(tab=tab)
        assert status == 101, status
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        try:
            while True:
                frame(self.socket)
        except (AssertionError, OSError):
            pass

    def post(self, path, body=None):
        return self.s.ask("POST", "/api/v1" + path, body or {}, tab=self.tab)

    def asked(self, step):
        def waits():
            m = self.s.json("GET", "/motion")
            job = self.s.json("GET", "/jobs")[0]
            assert job["state"] in ("queued", "running"), f"{step} was not asked for: {m}, {job}"
            return {"job": m["asked"]["job"], "hash": m["asked"]["hash"]} if m["asked"] and not m["moving"] and step == m["asked"]["step"] else None

        return until(step, waits)

    def arm(self):
        """Arms the robot, and confirms the look at it."""
        self.s.json("POST", "/lease", {"firmly": True}, tab=self.tab)
        self.s.json("POST", "/robot", {"armed": True}, tab=self.tab)
        self.s.json("POST", "/robot/looked", tab=self.tab)

    def begin(self):
        """Arms the robot and orders a job. Returns the job, which then proposes its first motion."""
        self.arm()
        return self.s.json("POST", "/jobs", {"procedure": "insert", "recipe": "osc", "sweep_mm": 20}, tab=self.tab)["id"]

    def press(self, what):
        status, _, body = self.post("/motion/press", what)
        assert status == 200, (status, body)
        return json.loads(body)["grant"]

    def go(self, what):
        """Presses, holds and confirms. From then on the caller must report that the button is held."""
        grant = self.press(what)
        time.sleep(HELD)
        status, _, body = self.post("/motion/go", {"grant": grant, "what": what})
        assert status == 200, (status, body)
        return grant

    @contextlib.contextmanager
    def holding(self, grant):
        """Reports the held button while other requests run, which may take longer than the button may be silent."""
        over = threading.Event()

        def talk():
            while not over.wait(0.1):
                say(self.socket, f"held {grant}")

        talker = threading.Thread(target=talk, daemon=True)
        talker.start()
        try:
            yield
        finally:
            over.set()
            talker.join()
            say(self.socket, f"held {grant}")

    def moves(self, job, grant, where):
        """Holds the button until the arm moves."""
        with self.holding(grant):
            until("that it moves", lambda: moving(where) or self.s.json("GET", f"/jobs/{job}")["state"] != "running")
        job = self.s.json("GET", f"/jobs/{job}")
        assert job["state"] == "running", job

    def confirms(self, over):
        """Confirms every motion that is shown, until `over` is set. Returns the steps; what goes wrong ends a motion, not this."""
        steps, last = [], None
        while not over.is_set():
            time.sleep(0.03)
            with contextlib.suppress(AssertionError, OSError, TypeError, KeyError):
                m = self.s.json("GET", "/motion")
                if not m["asked"] or m["moving"] or m["asked"]["hash"] == last:
                    continue
                last = m["asked"]["hash"]
                steps.append(m["asked"]["step"])
                grant = self.go({"job": m["asked"]["job"], "hash": last})
                with self.holding(grant):
                    until("the motion's end", lambda: over.is_set() or (self.s.json("GET", "/motion")["asked"] or {}).get("hash") != last)
                self.post("/motion/release")
        return steps
