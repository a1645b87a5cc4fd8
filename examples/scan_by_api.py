"""Drives a scan through the screen's API: python3 scan_by_api.py URL RECORDING RECIPE

URL is what `sheetlight station serve` prints, with its token behind #. Scans RECORDING, looks for the RECIPE's part in it, prints
where the tool goes, and leaves the cloud as cloud.ply. Needs nothing but Python's own library. docs/api.md describes the messages.
"""

import json
import sys
import time
import urllib.error
import urllib.request

url, recording, recipe = sys.argv[1:4]
server, token = url.split("/#token=")


def ask(method, path, body=None):
    """One request; a fault of the server ends the program with its sentences."""
    request = urllib.request.Request(
        f"{server}/api/v1{path}",
        data=None if body is None else json.dumps(body).encode(),
        headers={"Authorization": f"Bearer {token}", "X-Sheetlight-Tab": "example", "Content-Type": "application/json"},
        method=method,
    )
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.read()
    except urllib.error.HTTPError as e:
        fault = json.load(e)["error"]
        sys.exit(f"{fault['what']}\n  likely cause: {fault['cause']}\n  next step: {fault['next']}")


def run(order):
    """Orders a procedure and waits for its end."""
    job = json.loads(ask("POST", "/jobs", order))
    while job["state"] in ("queued", "running"):
        time.sleep(0.2)
        job = json.loads(ask("GET", f"/jobs/{job['id']}"))
    if job["state"] != "done":
        sys.exit(f"{job['id']}: {job['state']}: {job['problem']['what']}")
    return job


ask("POST", "/lease", {})  # One operates; refused while a person does.
scan = run({"procedure": "scan", "recording": recording})
print(f"{scan['outcome']['points']} points, each good to {scan['outcome']['median_sigma_mm']:.4f} mm")
found = run({"procedure": "find", "scans": [scan["id"]], "recipe": recipe})["outcome"]
if not found["passed"]:
    sys.exit("no pose: " + "; ".join(found["reasons"]))
poses = found["poses"]
for label, number in zip(poses["labels"], poses["insertion"]):
    print(f"{label:8} {number:10.4f}")
with open("cloud.ply", "wb") as out:
    out.write(ask("GET", f"/jobs/{scan['id']}/files/scan/cloud.ply"))
ask("POST", "/lease/release", {})
