"""In: a program with the order `extent`, a folder for a simulated station, the folder of the screen's tests. Out: failure
if the order does not return what the scan's own report says.
Frame and unit: mm."""

import sys

program, folder, tests = sys.argv[1:4]
sys.path.insert(0, tests)
from server import Server

s = Server(program, folder, "--simulate")
scanned = next(r["name"] for r in s.json("GET", "/recordings") if "scan" in r["suits"])
scan = s.job({"procedure": "scan", "recording": scanned})
extent = s.job({"procedure": "extent", "scan": scan["id"]})["outcome"]
told = {name: scan["outcome"][name] for name in ("points", "z_mm")}
assert extent == {"procedure": "extent", **told} and told["points"] > 1000, (extent, told)
