"""In: a machine that other programs use too. Out: the longest that it let a program wait beyond what that asked for; trials of what has a limit of
time, made again where the machine stood still in them, and nowhere else.
Frame and unit: s."""

import threading
import time

# What has a second's limit is not judged by a trial in which the machine stood still for so long.
LONG = 0.5
TRIALS = 10
NAP = 0.02


class Stalled(Exception):
    """The machine stood still, and what was to be judged ended by its limit of time."""


class Meter:
    """`longest` is the longest that a nap lasted too long since `clear`."""

    def __init__(self):
        self.longest = 0.0
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        while True:
            begun = time.monotonic()
            time.sleep(NAP)
            self.longest = max(self.longest, time.monotonic() - begun - NAP)

    def clear(self):
        self.longest = 0.0


def again(what, trial, clean=lambda: None):
    """What a trial gives, the first in which nothing stalled; `clean` takes away what a stalled one left."""
    for _ in range(TRIALS - 1):
        try:
            return trial()
        except Stalled as why:
            print(f"{what}: again, {why}")
            clean()
    return trial()
