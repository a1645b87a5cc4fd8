"""In: a recording. Out: the same pictures again and again, for what has to be met in the middle of a scan.
Frame and unit: none."""

import json
import os
import shutil


def longer(folder, times):
    """A copy of the recording `scan` beside it, so many times as long; its name."""
    name = f"scan-{times}-times"
    copy = shutil.copytree(os.path.join(folder, "scan"), os.path.join(folder, name))
    path = os.path.join(copy, "meta.json")
    with open(path) as f:
        meta = json.load(f)
    meta["frames"] *= times
    with open(path, "w") as f:
        json.dump(meta, f)
    return name
