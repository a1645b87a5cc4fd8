"""In: a recording. Out: a recording that repeats its pictures, for tests that must act during a scan.
Frame and unit: none."""

import json
import os
import shutil


def longer(folder, times):
    """Makes a copy of the recording `scan` that is `times` times as long. Returns its name."""
    name = f"scan-{times}-times"
    copy = shutil.copytree(os.path.join(folder, "scan"), os.path.join(folder, name))
    path = os.path.join(copy, "meta.json")
    with open(path) as f:
        meta = json.load(f)
    meta["frames"] *= times
    with open(path, "w") as f:
        json.dump(meta, f)
    return name
