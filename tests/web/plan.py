"""In: the program, a simulated station, a browser, a finished insertion. Out: failure if the path over a part on the page Scan
differs from that of the job or the command line, if speed, step and picture rate are inconsistent, if page and command
line compute different repeatability, or if dropped pictures are not counted.
Frame and unit: mm, mm/s, pictures a second."""

import csv
import json
import math
import os
import shutil
import subprocess

from shots import quiet

FIGURES = ("depth_mm", "length_mm", "step_mm", "shots", "part_mm", "field_mm", "swept_mm", "along_mm", "across_mm", "volume_mm", "box_mm")


def command(program, *words, code=0):
    done = subprocess.run([program, "--json", *words], capture_output=True, text=True, timeout=300)
    assert done.returncode == code, (words, done.returncode, done.stderr)
    # If the command failed, the fault follows the result.
    return json.JSONDecoder().raw_decode(done.stdout)[0]


def as_the_job(program, s, job, sweep_mm):
    """The planned sweep, from the server and the command line, is the one that the job made: number of shots, and the poses of
    the first and the last shot."""
    shown = s.json("GET", f"/sweep?recipe={job['order']['recipe']}&job={job['id']}&sweep_mm={sweep_mm}")
    # The folder of a simulated cell contains its station.
    station = s.station if os.path.isdir(os.path.join(s.station, "jobs")) else os.path.join(s.station, "station")
    folder = os.path.join(station, "jobs", job["id"])
    made = os.path.join(folder, "insertion")
    with open(os.path.join(made, "line", "meta.json")) as f:
        shots = [x for x in json.load(f)["frames"] if x.get("laser")]
    assert shown["touched"] and shown["shots"] == len(shots), (shown, len(shots))
    line = command(program, "sweep", "--station", station, "--recipe", os.path.join(folder, "recipe.toml"), "--job", made, "--sweep", str(sweep_mm), "--notation", "denso")
    assert line["touched"] and all(line["sweep"][k] == shown[k] for k in FIGURES), (line["sweep"], shown)
    with open(os.path.join(made, "line", "poses.json")) as f:
        poses = json.load(f)
    poses = poses["poses"] if isinstance(poses, dict) else poses
    row = lambda p: p if isinstance(p, list) else next(v for v in p.values() if isinstance(v, list) and len(v) == 16)
    for end, shot in ((0, shots[0]), (1, shots[-1])):
        stood, said = row(poses[shot["pose"]]), line["flange"][end]
        off = math.dist([stood[k] for k in (3, 7, 11)], [said[k] for k in (3, 7, 11)])
        assert off < 0.05, f"the job's shot was made {off} mm beside where the plan says"
        assert math.dist(shown["flange"][end][:3], [said[k] for k in (3, 7, 11)]) < 1e-3
    return shown


def drawn(s, b, recipe):
    """The page Scan draws the sweep, its figures are consistent, and the slowest of camera, chain and arm is named as the limit."""
    b.run("sessionStorage.recipe = arguments[0]", recipe)
    b.page("scan")
    plan = s.json("GET", f"/sweep?recipe={recipe}")
    b.until("the way over the part", "return Number(document.querySelector('[data-swept]')?.dataset.swept) === arguments[0]", plan["shots"])
    points = b.run("return document.querySelector('.sweep .band').getAttribute('points')")
    corners = [[float(v) for v in p.split(",")] for p in points.split()]
    assert all(math.dist(p, q) < 0.02 for p, q in zip(corners, plan["swept_mm"])), (corners, plan["swept_mm"])
    # The swept area is as long as the sweep.
    a, c = plan["swept_mm"][0], plan["swept_mm"][3]
    assert abs(math.dist(a, c) - plan["length_mm"]) < 1e-9
    # A camera that is slower than the processing chain is the limit, on any machine.
    slow = min(20, 0.5 * plan["chain_hz"]) if plan["chain_hz"] else 20
    for hz, step, limits in ((slow, 0.2, "camera"), (1e6, plan["limit_mm_s"] and 50, "speed")):
        if not step:
            continue
        for key, value in (("camera_hz", hz), ("step_mm", step)):
            b.run("const e = document.getElementById(arguments[0]); e.value = arguments[1]; e.dispatchEvent(new Event('change'))", f"plan-{key}", str(value))
        pace = s.json("GET", f"/sweep?recipe={recipe}&camera_hz={hz}&step_mm={step}")["pace"]
        assert pace["limited_by"] == limits and abs(pace["rate_hz"] * pace["step_mm"] - pace["speed_mm_s"]) < 1e-9 * pace["speed_mm_s"], pace
        assert abs(pace["seconds"] * pace["speed_mm_s"] - plan["length_mm"]) < 1e-6, pace
        # The page updates after each change and with the bar. An earlier plan may show the same limit, so that the figures are
        # checked too.
        b.until(
            f"that the {limits} limits, at {pace}",
            "const e = document.querySelector('[data-limit]'); return e?.dataset.limit === arguments[0] && arguments[1].every((v) => e.previousElementSibling.innerText.includes(v))",
            limits, [f"{pace['speed_mm_s']:.1f}", f"{pace['rate_hz']:.1f}"],
        )
    assert s.ask("GET", f"/api/v1/sweep?recipe={recipe}&sweep_mm=2")[0] == 400
    assert s.ask("GET", "/api/v1/sweep?recipe=../x")[0] == 400
    assert s.ask("GET", "/api/v1/sweep?recipe=nothere")[0] == 404
    quiet(b, "path over the part")
    return plan


def batched(program, *words, code=0):
    """The lines that a batch prints, one a recording."""
    done = subprocess.run([program, "batch", *words], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def batch(program, s, folder):
    """One command scans several recordings. Its scans are equal to those of the page, its table has every row, and its
    repeatability is that of the server."""
    out = os.path.join(folder, "batch")
    scan = os.path.join(folder, "scan")
    s.json("POST", "/lease", {"firmly": True})
    jobs = [s.job({"procedure": "scan", "recording": "scan", "settings": {"threshold.minimum": q} if q else {}}) for q in (0, 20)]
    assert all(j["state"] == "done" for j in jobs), jobs
    finds = [s.job({"procedure": "find", "scans": [j["id"]], "recipe": "led"}) for j in jobs]
    recipe = os.path.join(s.station, "jobs", finds[0]["id"], "recipe.toml")
    # The same pictures under another hash.
    twin = os.path.join(folder, "batch-inputs", "twin")
    shutil.copytree(scan, twin)
    with open(os.path.join(twin, "note.txt"), "w") as f:
        f.write("the part stood still")
    rows = batched(program, scan, twin, "--station", s.station, "--recipe", recipe, "--out", out)
    with open(os.path.join(out, "repeats.json")) as f:
        repeats = json.load(f)
    assert [r["recording"] for r in rows] == [scan, twin] and repeats["places"] == 2, (rows, repeats)
    first = finds[0]["outcome"]
    assert all(r["points"] == jobs[0]["outcome"]["points"] and math.dist(r["found"]["part"], first["part"]) < 1e-9 for r in rows), rows
    assert all(a["scatter"] < 1e-12 and a["stated"] > 0 for a in repeats["along"]), repeats
    # With another setting the place is another one, and both tell the same of the two.
    other = batched(program, scan, "--station", s.station, "--recipe", recipe, "--set", "threshold.minimum=20", "--out", out + "2")
    assert math.dist(other[0]["found"]["part"], finds[1]["outcome"]["part"]) < 1e-9
    told = s.json("POST", "/repeats", {"jobs": [j["id"] for j in finds]})
    x = [j["outcome"]["part"][3] for j in finds]
    along = told["along"][0]
    assert told["places"] == 2 and abs(along["apart"] - abs(x[0] - x[1])) < 1e-12 and abs(along["scatter"] - abs(x[0] - x[1]) / 2 ** 0.5) < 1e-9, told
    with open(os.path.join(out, "recordings.csv"), newline="") as f:
        table = list(csv.DictReader(f))
    assert [float(r["x_mm"]) for r in table] == [r["found"]["part"][3] for r in rows] and table[0]["passed"] == "true", table
    # One that is none is named, and the others go on.
    worse = batched(program, os.path.join(folder, "none"), scan, "--station", s.station, "--recipe", recipe, "--out", out + "3", code=1)
    assert worse[0]["problem"] and not worse[1]["problem"], worse
    done = subprocess.run([program, "batch", twin, "--station", s.station, "--out", scan], capture_output=True, text=True)
    assert done.returncode == 2 and "is a recording" in done.stderr, done.stderr
    s.json("POST", "/lease/release")


def health(program, s, b):
    """Dropped pictures are counted at half and at full resolution at the stated rate; every picture is accounted for."""
    b.page("health")
    b.run("const e = document.getElementById('rate'); e.value = 2000; e.dispatchEvent(new Event('change'))")
    b.click("#benchmark")
    b.until("what was counted", "return Number(document.querySelector('[data-kept]')?.dataset.kept) === 2", seconds=240)
    kept = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "benchmark")["outcome"]["kept_up"]
    for k in kept:
        assert k["rate_hz"] == 2000 and k["sent"] == k["measured"] + k["passed_over"] + k["lost"] and k["measured"] > 0, k
    half, full = kept
    assert [half["width"], full["width"]] == [640, 1280] and full["ms"][0] > half["ms"][0], kept
    # No test machine measures 2000 pictures a second at full resolution.
    assert full["passed_over"] + full["lost"] > 0 and full["measured"] < half["measured"], kept
    cells = b.run("return [...document.querySelectorAll('[data-kept] tbody td')].map((e) => e.innerText)")
    assert str(full["passed_over"]) in " ".join(cells), cells
    memory = s.json("GET", "/bar")["memory_mb"]
    assert memory is None or 10 < memory[0] <= memory[1] < 5000, memory
    line = command(program, "bench", "--keep-up", "20", "--seconds", "0.5")
    assert [k["width"] for k in line["kept_up"]] == [640, 1280] and line["rows"] and line["recorded"], line
    print("drops of 2000 pictures a second: " + "; ".join(f"{k['width']}x{k['height']} {k['measured']} of {k['sent']} measured, {k['ms'][0]:.2f} ms" for k in kept))
    quiet(b, "health, counted")
