"""In: a condition. Out: its value as soon as it is true; failure if it stays false for longer than even a busy machine needs.
This is no check of speed: a test of speed measures the time itself.
Frame and unit: s."""

import time

PATIENCE = 120


def until(what, holds, seconds=PATIENCE):
    """Calls `holds` repeatedly until it returns something true, and returns that. Fails after `seconds`."""
    end = time.monotonic() + seconds
    while not (value := holds()):
        assert time.monotonic() < end, f"{what}: not within {seconds} s: {value}"
        time.sleep(0.05)
    return value
