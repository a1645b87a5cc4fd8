"""In: a machine that other programs use too. Out: the longest time by which it delayed a sleeping program; repetition of tests
with a time limit, only if the machine stalled during the test.
Frame and unit: s."""

import threading
import time

# Delay above which a trial does not count for a limit of one second.
LONG = 0.5
TRIALS = 10
NAP = 0.02


class Stalled(Exception):
    """The machine stalled, and the trial failed because of a time limit."""


class Meter:
    """`longest` is the longest delay of a short sleep since `clear`."""

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
    """Result of the first trial without a stall, of at most `TRIALS`. `clean` removes what a stalled trial left."""
    for _ in range(TRIALS - 1):
        try:
            return trial()
        except Stalled as why:
            print(f"{what}: again, {why}")
            clean()
    return trial()
