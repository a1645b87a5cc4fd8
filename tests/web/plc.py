"""In: the program, a folder for a simulated cell, a folder with a station that has a recording, names of parts, the cell's speed,
the sweep's length, a number of random frames. Out: failure if a PLC cannot start and follow insertions over Modbus under the
conditions of the screen, if it starts anything without them or moves anything itself, or if its registers differ from what
the screen's own interface and the cell's truth say.
Frame and unit: mm, degrees; s."""

import json
import os
import random
import shutil
import socket
import subprocess
import sys
import threading
import time

import registers
from hands import Operator
from registers import AXIS, CALIBRATE, CAMERA, DONE, FAILED, FIND, GIVE, INSERT, LASER_PLANE, POSE, RUNS, SCAN, STOP, STOPPED, Plc, plain
from server import Server, events
from waits import PATIENCE, until

program, folder, recorded, parts, speed, sweep, frames = sys.argv[1:8]
SWEEP, FRAMES = float(sweep), int(frames)


def door(s):
    (link,) = [c for c in s.json("GET", "/settings")["connections"] if c["door"] == "modbus"]
    return link


def moves():
    """Number of motions in the cell's log, which is written shortly after them."""
    time.sleep(0.2)
    return sum(e["what"] == "move" for e in events(folder))


def refused(s, plc, code, words, *request):
    """A request is refused with its code, no job comes of it, and nothing moves."""
    jobs, before = s.json("GET", "/jobs"), moves()
    error, said, _ = plc.ask(*request)
    assert (error, words in said) == (code, True), (request, error, said)
    assert s.json("GET", "/jobs") == jobs and moves() == before, request
    assert said.split(":")[0] in door(s)["last_error"], (said, door(s))


def refusals(s, plc, op):
    old = plc.read()[3]
    assert plc.write(0, [(old + 9) % 65535 + 1, INSERT]).exception_code == 3
    assert plc.read()[2:4] == [0, old]
    until("the refusal", lambda: "does not follow" in door(s)["last_error"])
    plc.recipe("osc", SWEEP)
    job = plc.job()
    assert (job.linked, job.armed, job.attended, job.state, job.number) == (True, False, False, 0, 0), job
    refused(s, plc, 9, "the robot is not armed", INSERT)
    refused(s, plc, 4, "osc: is not there", SCAN)
    refused(s, plc, 4, "osc: is not there", CALIBRATE, CAMERA)
    refused(s, plc, 3, "INSERT scans", POSE)
    refused(s, plc, 3, "found nothing yet", GIVE, 1, 0)
    refused(s, plc, 3, "no scan is finished", FIND)
    refused(s, plc, 1, "are requests", 8)
    op.arm()
    until("the armed robot", lambda: plc.job().armed and plc.job().attended)
    plc.recipe("../osc")
    refused(s, plc, 1, "is not a recipe's name", INSERT)
    plc.recipe("none")
    refused(s, plc, 4, "is not a recipe of this station", INSERT)
    plc.recipe("osc", SWEEP)
    # Who armed the robot gives the lease back, or loses it to another screen.
    assert op.post("/lease/release")[0] == 200
    until("that nobody operates", lambda: not plc.job().attended)
    refused(s, plc, 10, "press Operate there", INSERT)
    s.json("POST", "/lease", {"firmly": True}, tab="other")
    refused(s, plc, 10, "another screen operates", INSERT)


def between(plc, job, seen, over):
    """Reads the registers until the job has ended; keeps every state that differs from the one before."""
    while not over.is_set():
        now = plc.job()
        if not seen or vars(now) != vars(seen[-1]):
            seen.append(now)
        if now.number == job and now.state not in (0, 1, RUNS):
            return
        time.sleep(0.02)


def only_the_screen_confirms(s, plc, name):
    """A motion waits for a person. Whatever the PLC writes, nothing moves; a second client reads and cannot write."""
    until("the first question", lambda: plc.job().asks == "touch")
    before = moves()
    number = int(name.split("-")[0])
    error, said, _ = plc.ask(INSERT)
    assert error == 6 and name in said, (error, said)
    panel = Plc(plc.port, "127.0.0.2")
    assert panel.job().number == number and panel.write(0, [0]).exception_code == 6
    until("both peers", lambda: len(door(s)["peers"]) == 2 and any("127.0.0.2" in p for p in door(s)["peers"]))
    panel.close()
    attack(s, plc)
    job = plc.job()
    assert (job.asks, job.step, job.state, job.number, job.moves) == ("touch", "touch", RUNS, number, False), job
    assert moves() == before


def inserted(s, plc, op, part, first):
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/simulated", {"holds": part})
    op.arm()
    begun, counts = len(events(folder)), (plc.job().ended, plc.job().inserted)
    plc.recipe(part, SWEEP)
    error, said, _ = plc.ask(INSERT)
    assert error == 0, (error, said)
    name = s.json("GET", "/jobs")[0]["id"]
    job = plc.job()
    assert job.number == int(name.split("-")[0]) and job.procedure == INSERT and job.found == 0, job
    if first:
        only_the_screen_confirms(s, plc, name)
        # The PLC disappears; the job goes on, as it does when a tab is closed that holds no button.
        plc.close()
        assert s.json("GET", f"/jobs/{name}")["state"] == "running"
        plc = Plc(plc.port)
    over, seen, confirmed = threading.Event(), [], []
    person = threading.Thread(target=lambda: confirmed.extend(op.confirms(over)), daemon=True)
    person.start()
    try:
        end = time.monotonic() + 600
        reads = threading.Thread(target=between, args=(plc, job.number, seen, over), daemon=True)
        reads.start()
        while reads.is_alive() and time.monotonic() < end:
            reads.join(0.1)
    finally:
        over.set()
        person.join(PATIENCE)
    job, stored = seen[-1], s.json("GET", f"/jobs/{name}")
    assert (job.state, job.error, job.words, job.step, job.asks) == (DONE, 0, "", "done", ""), (job, stored)
    steps = [j.step for k, j in enumerate(seen) if j.step and (k == 0 or j.step != seen[k - 1].step)]
    asks = [j.asks for k, j in enumerate(seen) if j.asks and (k == 0 or j.asks != seen[k - 1].asks)]
    assert steps == registers.STEPS[1:8], steps
    assert asks == ["touch", "scan", "approach", "insert", "retract"], (asks, confirmed)
    assert all(j.found == 1 for j in seen if j.step in ("approach", "insert", "retract")), seen
    assert any(j.moves for j in seen) and not any(j.moves and j.asks for j in seen)
    assert (job.ended - counts[0], job.inserted - counts[1]) == (1, 1), job
    # The same numbers as the screen's.
    found = stored["outcome"]["found"]
    agree(job, found)
    tool = plc.ask(GIVE, 1, 0)
    assert tool[0] == 0 and tool[2][5] == 2 and abs(tool[2][7] / 1000 - found["score"]) < 0.001, tool[:2]
    for which, pose in enumerate(("approach", "insertion", "retract")):
        error, said, r = plc.ask(GIVE, which, 0)
        assert error == 0 and near(plc.given(r), found["poses"][pose]), (said, plc.given(r))
        error, said, flange = plc.ask(GIVE, which, 1)
        assert error == 0 and not near(plc.given(flange), plc.given(r)), said
    # The cell's own truth.
    log = until("what the gripper did", lambda: [e for e in events(folder)[begun:] if e["what"] == "released"])
    assert len(log) == 1 and log[0]["inserted"], log
    assert not any(e["what"] == "collision" for e in events(folder)[begun:])
    print(f"{part}: inserted {log[0]['lateral_mm']:.3f} mm aside, {len(seen)} states read, questions {confirmed}")
    return plc


def near(a, b):
    """Equal to the units of the registers; an angle may have gone round."""
    return all(abs(x - y) <= 0.00051 or k > 2 and abs(abs(x - y) - 360) < 0.001 for k, (x, y) in enumerate(zip(a, b)))


def agree(job, found):
    assert job.found == 1 and near(job.pose, found["poses"]["insertion"]), (job.pose, found["poses"])
    sigma = [*found["sigma_mm"], *found["sigma_deg"]]
    assert all(abs(x - y) <= 0.000051 for x, y in zip(job.sigma, sigma)), (job.sigma, sigma)
    names = {g["name"] for g in found["gates"]}
    assert job.judged == names & set(registers.GATES) and job.passed == job.judged and "score" in names, (job, names)


def ends(s, plc, op):
    """A job that is refused by the person, one that the PLC stops, and the look that is asked for after a halt: codes and words."""
    def begins():
        op.arm()
        plc.recipe("osc", SWEEP)
        assert plc.ask(INSERT)[0] == 0
        return op.asked("touch")

    def ended(what, state, code):
        stored = s.ended(what["job"])
        job = until("its end", lambda: (lambda j: j if j.state not in (0, 1, RUNS) else None)(plc.job()))
        assert (job.state, job.error) == (state, code), (job, stored)
        assert job.words == plain(stored["problem"]["what"]) != "", (job, stored)
        return job

    what = begins()
    before = moves()
    assert op.post("/motion/refuse", what)[0] == 200
    ended(what, FAILED, 4)
    what = begins()
    assert plc.ask(STOP)[0] == 0
    job = ended(what, STOPPED, 12)
    assert moves() == before and job.found == 0, job
    until("that somebody must look", lambda: plc.job().look)
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/robot", {"armed": True})
    refused(s, plc, 11, "has to look at the robot", INSERT)
    s.json("POST", "/robot/looked")


def outside(path):
    """All files beside the station and the cell's log."""
    return sorted(os.path.join(root, f) for root, _, files in os.walk(path) for f in files if "/station" not in root and f != "cell.jsonl")


def attack(s, plc):
    """Foreign bytes, changed frames, a flood, many connections: nothing moves, no job comes of it, no file lies elsewhere, and
    the registers and the screen are served."""
    port = plc.port
    s.json("POST", "/lease", {})
    chance, before = random.Random(7), (moves(), [j["id"] for j in s.json("GET", "/jobs")], outside(folder))
    read = bytes.fromhex("000100000006010400000079")
    writes = [bytes.fromhex("00020000000b0110000000020400050005"), bytes.fromhex("000300000006010600000001")]
    for k in range(FRAMES):
        if k % 100 == 0:
            # PLC and screen stay, which are let go when they are silent for a minute.
            plc.read()
            s.json("POST", "/lease", {})
        frame = bytearray([read, *writes][k % 3])
        for _ in range(chance.randrange(1, 6)):
            # Not the request itself: a STOP by chance would end the job, as it may.
            frame[chance.choice([n for n in range(len(frame)) if n not in (14, 15, 16)])] = chance.randrange(256)
        if k % 5 == 0:
            frame = bytearray(chance.randbytes(chance.randrange(1, 300)))
        with socket.create_connection(("127.0.0.1", port), 10) as wire:
            wire.settimeout(10)
            wire.sendall(frame[: chance.randrange(1, len(frame) + 1)] if k % 4 == 0 else frame)
            wire.shutdown(socket.SHUT_WR)
            try:
                while wire.recv(512):
                    pass
            except ConnectionResetError:
                pass
    with socket.create_connection(("127.0.0.1", port), 10, ("127.0.0.3", 0)) as wire:
        wire.sendall(b"GET / HTTP/1.1\r\n\r\n")
        assert wire.recv(100) == b""
    until("whose bytes they were", lambda: door(s)["last_error"].startswith("127.0.0.3: the protocol identifier"))
    # A flood is answered slowly: 100 frames at once, then 200 a second. The screen is served meanwhile.
    many = 260
    with socket.create_connection(("127.0.0.1", port), 10, ("127.0.0.3", 0)) as wire:
        begun, got = time.monotonic(), 0
        wire.sendall(bytes.fromhex("000100000006010400000001") * many)
        assert s.ask("GET", "/api/v1/motion")[0] == 200
        while got < 11 * many:
            got += len(wire.recv(4096))
        assert time.monotonic() - begun > 0.95 * (many - 100) / 200, "a flood is answered without a pause"
    # Connections of one machine are counted, and leave places for others.
    wires = [socket.create_connection(("127.0.0.1", port), 10, ("127.0.0.3", 0)) for _ in range(20)]
    until("that some are refused", lambda: "of this machine" in door(s)["last_error"])
    assert len([p for p in door(s)["peers"] if p.startswith("127.0.0.3:")]) <= 8, door(s)
    Plc(port).close()
    for wire in wires:
        wire.close()
    assert (moves(), [j["id"] for j in s.json("GET", "/jobs")], outside(folder)) == before


def simulated():
    s = Server(program, folder, "--simulate", "--set", "none", "--speed", speed, "--modbus", "0")
    host, port = door(s)["address"].rsplit(":", 1)
    assert host == "127.0.0.1" and door(s)["problem"] is None and door(s)["peers"] == [], door(s)
    plc, op = Plc(int(port)), Operator(s)
    plc.port = int(port)
    until("the peer", lambda: len(door(s)["peers"]) == 1 and door(s)["rate_hz"] > 0)
    attack(s, plc)
    plc.number = plc.read()[3]
    refusals(s, plc, op)
    for k, part in enumerate(parts.split(",")):
        port = plc.port
        plc = inserted(s, plc, op, part, k == 0)
        plc.port = port
    ends(s, plc, op)
    figures = s.ask("GET", "/api/v1/metrics")[2].decode()
    assert "sheetlight_modbus_peers 1" in figures and 'sheetlight_modbus_frames_total{result="answered"}' in figures, figures
    said = "".join(s.said)
    assert "panicked" not in said, said
    assert s.end() == 0
    # What the last start's PLC still writes is no request of the next start, which shows the job of before.
    again = Server(program, folder, "--simulate", "--set", "none", "--modbus", str(plc.port))
    after = Plc(plc.port)
    job = after.job()
    assert (job.state, job.error, job.ended) == (STOPPED, 12, 0) and job.words, job
    if plc.number % 65535 + 1 != after.read()[3] % 65535 + 1:
        assert after.write(0, [plc.number % 65535 + 1, INSERT]).exception_code == 3
    after.close()
    assert again.end() == 0


def last(s):
    return s.json("GET", "/jobs")[0]


def cut(name, frames, to, times=1):
    """A copy of a recording with its first frames, some times over, begun now."""
    copy = shutil.copytree(os.path.join(recorded, name), os.path.join(recorded, to))
    path = os.path.join(copy, "meta.json")
    with open(path) as f:
        meta = json.load(f)
    meta["frames"] = meta["frames"][:frames] * times
    with open(path, "w") as f:
        json.dump(meta, f)


def made(s, plc, *request):
    """Orders a scan or a calibration, and waits for its end. Returns registers and record of its job, which agree."""
    s.json("POST", "/lease")
    ended = plc.job().ended
    error, said, _ = plc.ask(*request)
    assert error == 0, (error, said)
    # Taken at once, not when it has begun.
    assert plc.made().recording == last(s)["order"]["recording"], plc.made()
    job = until("its end", lambda: (lambda j: j if j.ended > ended else None)(plc.job()), 5 * PATIENCE)
    stored, of = last(s), plc.made()
    assert job.number == int(stored["id"].split("-")[0]) and (job.procedure, job.step, job.asks) == (request[0], "", ""), job
    assert of.recording == stored["order"]["recording"] and (job.found, job.ended) == (0, ended + 1), (of, job)
    assert (job.state == DONE) == (stored["state"] == "done"), (job, stored)
    return job, of, stored


def scanned(s, plc):
    """Scans and calibrations from recordings: by name or the newest one, with a screen that operates, nothing outside their
    folder; nothing is stored in the station."""
    station = os.path.join(recorded, "station", "calibration")
    calibrations = lambda: {f: open(os.path.join(station, f), "rb").read() for f in sorted(os.listdir(station))}
    before = calibrations()
    plc.recipe("scan")
    s.json("POST", "/lease/release")
    refused(s, plc, 10, "no screen operates", SCAN)
    refused(s, plc, 10, "no screen operates", CALIBRATE, CAMERA)
    s.json("POST", "/lease")
    for name, code, words in [
        ("none", 4, "none: is not there"),
        ("scan/none", 4, "is not there"),
        ("..", 1, "invalid file name"),
        ("../recorded/scan", 1, "invalid file name"),
        ("scan/../../etc", 1, "invalid file name"),
        ("/etc", 1, "invalid file name"),
        ("scan\\..", 1, "invalid file name"),
        (" scan", 1, "invalid file name"),
        ("pr\u00fcfung", 1, "plain ASCII"),
        ("sc\nan", 1, "plain ASCII"),
    ]:
        plc.recipe(name)
        refused(s, plc, code, words, SCAN)
        refused(s, plc, code, words, CALIBRATE, CAMERA)
    plc.recipe("intrinsics")
    for target in (0, 6, 65535):
        refused(s, plc, 1, f"register 2 is {target}, 1 to 5 are camera", CALIBRATE, target)
    plc.recipe("")
    refused(s, plc, 4, "no complete recording of boards", CALIBRATE, AXIS)
    # While a job runs, no other one is taken.
    cut("scan", None, "a-long-one", 100)
    runs = s.json("POST", "/jobs", {"procedure": "scan", "recording": "a-long-one"})["id"]
    for other in ([SCAN], [CALIBRATE, CAMERA]):
        error, said, _ = plc.ask(*other)
        assert error == 6 and f"{runs} runs or waits" in said, (other, error, said)
    s.json("POST", f"/jobs/{runs}/stop")
    s.ended(runs)
    cut("scan", 20, "a-newer-one")
    cut("intrinsics", 5, "boards")
    cut("intrinsics", 2, "few")
    job, of, stored = made(s, plc, SCAN)
    assert of.recording == "a-newer-one" and job.error == 0, (of, job)
    figures = stored["outcome"]
    assert (of.shots, of.points, of.verdict, of.target) == (figures["shots"], figures["points"], "none", 0), (of, figures)
    assert of.shots == 20 and of.points > 100, of
    # Two pictures: nobody may accept that, and the job has an error.
    job, of, stored = made(s, plc, CALIBRATE, CAMERA)
    assert (of.recording, of.verdict, job.state, job.error) == ("few", "badly determined", DONE, 4), (of, job, stored)
    assert job.words.startswith("the calibration is badly determined: 2 pictures"), job
    assert s.ask("POST", f"/api/v1/jobs/{stored['id']}/accept")[0] >= 400
    plc.recipe("boards")
    job, of, stored = made(s, plc, CALIBRATE, CAMERA)
    figures = stored["outcome"]
    assert (job.error, of.target, of.verdict) == (0, CAMERA, figures["verdict"]), (job, of, figures)
    assert of.verdict in ("good", "usable") and not figures["accepted"] and (of.shots, of.points) == (0, 0), (of, figures)
    # A recording that is no calibration's: the job says so in its own words.
    plc.recipe("scan")
    job, of, stored = made(s, plc, CALIBRATE, LASER_PLANE)
    assert (job.state, of.verdict, of.target) == (FAILED, "none", LASER_PLANE), (job, of)
    assert job.error in (4, 14) and job.words == plain(stored["problem"]["what"]), (job, stored["problem"])
    assert calibrations() == before, "a calibration was stored that nobody accepted"
    job, of, stored = made(s, plc, SCAN)
    assert (of.recording, job.error, of.points) == ("scan", 0, stored["outcome"]["points"]), (of, job)


def found():
    """A search without insertion, in the last scan of the screen; the door open to other machines."""
    s = Server(program, recorded, "--recordings", recorded, "--modbus", "0.0.0.0:0")
    until("the warning", lambda: "Modbus has no login" in "".join(s.said))
    port = int(door(s)["address"].rsplit(":", 1)[1])
    plc = Plc(port)
    before = plc.job()
    assert s.job({"procedure": "scan", "recording": "scan"})["state"] == "done"
    # A scan of the screen takes the place of nothing that a PLC may ask for.
    assert vars(plc.job()) == vars(before), before
    scanned(s, plc)
    plc.recipe("led")
    s.json("POST", "/lease/release")
    refused(s, plc, 10, "no screen operates", FIND)
    refused(s, plc, 9, "without --robot", INSERT)
    s.json("POST", "/lease")
    ended, scan = plc.job().ended, last(s)
    assert plc.ask(FIND)[0] == 0
    job = until("the search", lambda: (lambda j: j if j.ended > ended else None)(plc.job()))
    stored = last(s)
    assert (job.procedure, job.step, job.error, job.inserted, job.state) == (FIND, "", 0, 0, DONE), job
    assert stored["order"]["scans"] == [scan["id"]] and scan["order"]["procedure"] == "scan", (stored["order"], scan)
    assert vars(plc.made()) == {"target": 0, "verdict": "none", "shots": 0, "points": 0, "recording": ""}, plc.made()
    agree(job, stored["outcome"])
    # Without [tool] the flange is not known.
    error, said, _ = plc.ask(GIVE, 1, 1)
    assert error == 5 and "no [tool]" in said, (error, said)
    # A part that is not in the scan.
    plc.recipe("dimm")
    assert plc.ask(FIND)[0] == 0
    job = until("the search", lambda: (lambda j: j if j.ended > ended + 1 else None)(plc.job()))
    stored = last(s)
    assert job.error == 4 and job.found != 1 and job.words, (job, stored["problem"])
    if stored["problem"]:
        assert job.words == plain(stored["problem"]["what"])
    # A pose that is not there is not given.
    error, said, _ = plc.ask(GIVE, 1, 0)
    assert error in (3, 4), (error, said)
    plc.close()
    assert s.end() == 0


def misused():
    """Addresses that are none or taken end the start."""
    run = lambda *words: subprocess.run([program, "station", "serve", "--station", os.path.join(recorded, "station"), "--port", "0", *words], capture_output=True, text=True, timeout=60)
    done = run("--modbus", "here")
    assert done.returncode == 2 and "ADDRESS:PORT" in done.stderr, done
    with socket.create_server(("127.0.0.1", 0)) as taken:
        done = run("--modbus", str(taken.getsockname()[1]))
    assert done.returncode == 1 and "cannot be listened on" in done.stderr, done


if not registers.present():
    print("pymodbus is not here (make python)")
    sys.exit(77)
misused()
found()
simulated()
