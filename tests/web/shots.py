"""In: a browser. Out: small screenshots for the documents; failure if the console contains an error.
Frame and unit: seconds."""

import os
import time

import waits
from browser import levels


def shot(b, folder, name):
    """Stores a screenshot in a folder; does nothing without a folder."""
    if folder:
        time.sleep(0.4)
        with open(os.path.join(folder, f"screen-{name}.png"), "wb") as f:
            f.write(levels(b.picture()))


def quiet(b, where, refused=0, aside=None):
    """The console contains only the expected refusals: a browser logs each answer 4xx there. Messages that contain `aside`, a
    part of an address that may be refused at any time, are ignored."""
    said = []

    def asked():
        said.extend(m for m in b.console() if not aside or aside not in m)
        return [m for m in said if "status of 4" in m]

    # The page shows a refusal and the browser logs it, in any order.
    waits.until(f"{where}: {refused} refusals", lambda: len(asked()) >= refused)
    assert len(asked()) == refused, f"{where}: {asked()}"
    said = [m for m in said if "status of 4" not in m]
    assert not said, f"{where}: the console says {said}"
