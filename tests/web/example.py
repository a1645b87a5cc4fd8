"""In: the program, a simulated station, the example of docs/api.md. Out: failure if the example does not do what the
document says.
Frame and unit: mm."""

import os
import subprocess
import sys

from server import Server

program, folder, example = sys.argv[1:4]
s = Server(program, folder, "--recordings", folder)
try:
    run = lambda *args: subprocess.run([sys.executable, example, *args], cwd=folder, capture_output=True, text=True, timeout=120)
    done = run(s.url, "scan", "led")
    assert done.returncode == 0, done.stderr
    assert "X mm" in done.stdout and "points, each good to 0.0" in done.stdout, done.stdout
    assert os.path.getsize(os.path.join(folder, "cloud.ply")) > 100_000
    wrong = run(s.url, "scna", "led")
    assert wrong.returncode != 0 and "scna" in wrong.stderr, wrong.stderr
    stale = run(s.url[:-4] + "0000", "scan", "led")
    assert stale.returncode != 0 and "not signed in" in stale.stderr, stale.stderr
finally:
    s.end()
