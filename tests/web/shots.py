"""In: a browser. Out: pictures of its page for the documents, small; failure where a script complains.
Frame and unit: seconds."""

import os
import time

import waits
from browser import levels


def shot(b, folder, name):
    """The page as it stands, into a folder; none: nothing."""
    if folder:
        time.sleep(0.4)
        with open(os.path.join(folder, f"screen-{name}.png"), "wb") as f:
            f.write(levels(b.picture()))


def quiet(b, where, refused=0, aside=None):
    """No complaint but so many refusals that were asked for: browsers write answers of 4xx there. Those of what may be refused at any time,
    by this part of their address, are not counted."""
    said = []

    def asked():
        said.extend(m for m in b.console() if not aside or aside not in m)
        return [m for m in said if "status of 4" in m]

    # A refusal is shown by the page and written by the browser, in no order.
    waits.until(f"{where}: {refused} refusals", lambda: len(asked()) >= refused)
    assert len(asked()) == refused, f"{where}: {asked()}"
    said = [m for m in said if "status of 4" not in m]
    assert not said, f"{where}: the console says {said}"
