"""In: a browser. Out: pictures of its page for the documents, small; failure where a script complains.
Frame and unit: seconds."""

import os
import time

from browser import levels


def shot(b, folder, name):
    """The page as it stands, into a folder; none: nothing."""
    if folder:
        time.sleep(0.4)
        with open(os.path.join(folder, f"screen-{name}.png"), "wb") as f:
            f.write(levels(b.picture()))


def quiet(b, where, refused=0):
    """No complaint but so many refusals that were asked for: browsers write answers of 4xx there."""
    said = b.console()
    asked = [m for m in said if "status of 4" in m]
    assert len(asked) == refused, f"{where}: {asked}"
    said = [m for m in said if m not in asked]
    assert not said, f"{where}: the console says {said}"
