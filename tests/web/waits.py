"""In: what has to become so. Out: it, as soon as it is; failure where it is not for longer than any machine takes that other programs use too.
How long something may take is judged nowhere here: who judges that measures it.
Frame and unit: s."""

import time

PATIENCE = 120


def until(what, holds, seconds=PATIENCE):
    """Asks again and again until it holds, and gives what it holds."""
    end = time.monotonic() + seconds
    while not (value := holds()):
        assert time.monotonic() < end, f"{what}: not within {seconds} s: {value}"
        time.sleep(0.05)
    return value
