"""Calibrates a stationary camera through the API, and compares the result with that of the command line."""

import json
import math
import os
import shutil
import subprocess
import sys

from server import Server

program, folder = sys.argv[1:3]
station = os.path.join(folder, "station")
calibration = os.path.join(station, "calibration")


def inverse(m):
    """Inverse of a rigid transform, 16 numbers row by row."""
    turn = [[m[4 * j + i] for j in range(3)] for i in range(3)]
    shift = [-sum(turn[i][j] * m[4 * j + 3] for j in range(3)) for i in range(3)]
    return [v for i in range(3) for v in (*turn[i], shift[i])] + [0, 0, 0, 1]


def fixed():
    """Makes the recording of a camera beside the robot from the same pictures: the poses are inverted, so that the flange
    carries the board instead of the camera."""
    to = os.path.join(folder, "fixed")
    # The page does not ask for a pose file: meta.json names the only one.
    meta = os.path.join(folder, "handeye", "meta.json")
    with open(meta) as f:
        told = json.load(f)
    with open(meta, "w") as f:
        json.dump({**told, "pose_file": "poses_noisy"}, f)
    shutil.copytree(os.path.join(folder, "handeye"), to)
    for name in os.listdir(to):
        path = os.path.join(to, name)
        if name.endswith(".csv"):
            os.remove(path)
        elif name.endswith(".json") and name not in ("meta.json", "truth.json"):
            with open(path) as f:
                poses = json.load(f)
            for pose in poses.get("poses", []):
                pose["matrix"] = inverse(pose["matrix"])
            with open(path, "w") as f:
                json.dump(poses, f)


def record(where, kind):
    with open(os.path.join(where, "calibration", f"{kind}.json")) as f:
        return json.load(f)


fixed()
with open(os.path.join(station, "station.toml"), "w") as f:
    f.write('name = "cell 3" # by the window\n')
truth = record(station, "hand_eye")["value"]
os.remove(os.path.join(calibration, "hand_eye.json"))
by_hand, twin = os.path.join(folder, "by hand"), os.path.join(folder, "twin")
for copy in (by_hand, twin):
    shutil.copytree(station, copy)
run = lambda *words: subprocess.run([program, "--quiet", *words], capture_output=True, text=True)
calibrate = lambda *words: run("calibrate", "hand-eye", os.path.join(folder, "fixed"), "--station", *words)
s = Server(program, folder, "--recordings", folder)
try:
    order = {"procedure": "calibrate", "target": "hand_eye", "recording": "fixed"}
    # No setting states the mount: the camera is assumed to be on the flange, which contradicts these pictures.
    wrong = s.job(order)
    assert wrong["state"] == "failed" or "accepted" in wrong["outcome"] and wrong["outcome"]["verdict"] != "good", wrong
    plain = s.job({**order, "recording": "handeye"})["outcome"]
    assert plain["kind"] == "hand_eye" and any("taken to be on the flange" in r for r in plain["reasons"]), plain["reasons"]
    now = s.json("GET", "/settings")
    s.json("PUT", "/settings", {"sha256": now["sha256"], "changes": {"mount": "eye-to-hand"}})
    with open(os.path.join(station, "station.toml")) as f:
        text = f.read()
    assert "# by the window" in text and 'mount = "eye-to-hand"' in text, text
    assert s.json("GET", "/station")["mount"] == "eye-to-hand"
    job = s.job(order)
    assert job["state"] == "done", job
    o = job["outcome"]
    assert o["kind"] == "base_camera" and o["verdict"] in ("good", "usable"), o
    assert not any("taken to be" in r for r in o["reasons"]), o["reasons"]
    assert not os.path.exists(os.path.join(calibration, "base_camera.json")), "stored before anybody accepted it"
    s.json("POST", f"/jobs/{job['id']}/accept")
    made = record(station, "base_camera")
    off = math.dist([truth[k] for k in (3, 7, 11)], [made["value"][k] for k in (3, 7, 11)])
    print(f"a camera that stands still: {o['verdict']}, {off:.4f} mm from the truth")
    assert off < 0.5, off
    # On the command line the option states the mount if the station does not. If the station does, the option is not needed
    # and must agree.
    done = calibrate(by_hand, "--mount", "eye-to-hand")
    assert done.returncode == 0, done.stderr
    shutil.copy(os.path.join(station, "station.toml"), twin)
    done = calibrate(twin, "--mount", "eye-in-hand")
    assert done.returncode == 1 and "station.toml says eye-to-hand" in done.stderr, done.stderr
    assert not os.path.exists(os.path.join(twin, "calibration", "base_camera.json"))
    done = calibrate(twin)
    assert done.returncode == 0, done.stderr
    for where in (by_hand, twin):
        theirs = record(where, "base_camera")
        for key in ("value", "covariance", "inputs"):
            assert theirs[key] == made[key], (where, key)
    # The joint calibration uses the same mount.
    joint = s.job({"procedure": "joint", "recordings": ["intrinsics", "fixed"]})
    assert joint["state"] == "done", joint
    kept = record(os.path.join(station, "jobs", joint["id"], "result"), "base_camera")
    assert math.dist([truth[k] for k in (3, 7, 11)], [kept["value"][k] for k in (3, 7, 11)]) < 0.5, kept["value"]
    made = run("station", "new", "--station", os.path.join(folder, "new"), "--mount", "eye-to-hand")
    assert made.returncode == 0, made.stderr
    with open(os.path.join(folder, "new", "station.toml")) as f:
        assert 'mount = "eye-to-hand"' in f.read()
finally:
    s.end()
