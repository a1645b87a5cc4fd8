"""In: the program sheetlight-opcua, the program sheetlight, an empty folder, names of parts, the cell's speed, the
sweep's length, a number of random frames. Out: failure if an OPC UA client cannot start and follow insertions under
the conditions of the screen, if it starts anything without them or moves anything itself, if states, events or
results differ from what the screen's own interface and the cell's truth say, or if foreign bytes, many connections,
strangers or a lost station do more than they may. The client is asyncua, which shares no code with the server.
Frame and unit: mm, degrees; s."""

import asyncio
import contextlib
import os
import random
import socket
import subprocess
import sys
import threading
import time

import clients
from clients import Client, Gateway, settled
from hands import Operator
from server import Server, events
from waits import until

program, sheetlight, folder, parts, speed, sweep, frames = sys.argv[1:8]
PARTS, SWEEP, FRAMES = parts.split(","), float(sweep), int(frames)


def door(s):
    (link,) = [c for c in s.json("GET", "/settings")["connections"] if c["door"] == "modbus"]
    return link["address"]


def moves():
    """Number of motions in the cell's log, which is written shortly after them."""
    time.sleep(0.2)
    return sum(e["what"] == "move" for e in events(folder))


def jobs(s):
    return [j["id"] for j in s.json("GET", "/jobs")]


async def refuses(c, number, words, made):
    """A call is refused with its number; the words are there."""
    *_, error = await made
    assert error == number, (error, number, await c.shown("LastRefusalWords"))
    assert await c.shown("LastRefusal") == number and words in await c.shown("LastRefusalWords"), await c.shown(
        "LastRefusalWords"
    )


async def invalid(made):
    """A call is not possible in this state."""
    try:
        await made
    except c_ua().UaStatusCodeError as e:
        assert e.code == c_ua().StatusCodes.BadInvalidState, e
    else:
        raise AssertionError("a call in a wrong state was accepted")


def c_ua():
    from asyncua import ua

    return ua


def misused():
    """Wrong options end the start with a reason."""
    run = lambda *words: subprocess.run(
        [program, "--station", "127.0.0.1:9", *words], capture_output=True, text=True, timeout=60
    )
    done = run("--listen", "opc.tcp://0.0.0.0:0")
    assert done.returncode == 2 and "--pki or --login is missing" in done.stderr and "next step" in done.stderr, done
    with socket.create_server(("127.0.0.1", 0)) as taken:
        done = run("--listen", f"opc.tcp://127.0.0.1:{taken.getsockname()[1]}")
    assert done.returncode == 1 and "cannot be listened on" in done.stderr, done
    done = run("--listen", "127.0.0.1:4840")
    assert done.returncode == 2 and "wanted opc.tcp://HOST:PORT" in done.stderr, done
    done = run(
        "--login",
        os.path.join(folder, "none"),
        "--pki",
        os.path.join(folder, "none-pki"),
        "--listen",
        "opc.tcp://127.0.0.1:0",
    )
    assert done.returncode == 1 and "two lines" not in done.stdout and "--login" in done.stderr, done


async def nobody():
    """A station that is not there is the state Error, in which nothing starts."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    g = Gateway(program, f"127.0.0.1:{port}")
    async with Client(g.url) as c:
        await c.until_state("Error")
        assert await c.shown("Connected") is False and await c.shown("Trouble") != ""
        await invalid(c.start("osc"))
        await invalid(c.call("VisionStateMachine.SelectModeAutomatic"))
        # What listens there is no Modbus: still Error, and the reason is said.
        with socket.create_server(("127.0.0.1", port)) as foreign:
            foreign.settimeout(10)
            wire, _ = foreign.accept()
            wire.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            await c.until_shown("Trouble", lambda why: "does not speak Modbus" in why)
            wire.close()
        assert await c.call("VisionStateMachine.Halt", 0, "test") == 0
        await c.until_state("Halted")
        assert await c.call("VisionStateMachine.Reset", 0, "test") == 0
        await c.until_state("Error")
    assert "is not reached" in g.said() and "does not speak Modbus" in g.said(), g.said()
    assert g.end() == 0


async def refusals(c, s):
    """From Preoperational to Ready; what is not possible is refused, and no job comes of it."""
    ua = c_ua()
    before = (jobs(s), moves())
    await c.until_state("Preoperational")
    assert await c.automatic() is None
    await invalid(c.start("osc"))
    await invalid(c.prepare("osc"))
    await invalid(c.stop())
    assert await c.call("VisionStateMachine.SelectModeAutomatic") == 0
    await c.until_state("Operational", "Initialized")
    await invalid(c.call("VisionStateMachine.SelectModeAutomatic"))
    await invalid(c.start("osc"))
    await refuses(c, -1, "is not a recipe's name", c.prepare("../osc"))
    await refuses(c, -4, "not one of the recipes", c.prepare("none"))
    name, complete, error = await c.prepare("osc")
    assert (name.Id, complete, error) == ("osc", True, 0), (name, complete, error)
    await c.until_state("Operational", "Ready")
    complete, count, handle, listed, error = await c.recipes()
    assert (complete, count, error) == (True, len(PARTS), 0) and [r.Id for r in listed] == PARTS, listed
    complete, count, handle, listed, error = await c.recipes(prepared=1)
    assert [r.Id for r in listed] == ["osc"], listed
    # The robot is not armed: that is the station's refusal, with its number and words.
    await refuses(c, -9, "the robot is not armed", c.start("osc"))
    await refuses(c, -104, "is prepared, not led", c.start("led"))
    await refuses(c, -103, "single jobs only", c.continuous())
    await refuses(c, -105, "no result 17", c.result_of("17"))
    for bad in (["sweep_mm=nan"], ["sweep_mm=x"], ["dance"], ["find"] * 9, [1.5]):
        with contextlib.suppress(ua.UaStatusCodeError):
            await c.start("osc", parameters=bad)
            raise AssertionError(bad)
    with contextlib.suppress(ua.UaStatusCodeError):
        await c.start("osc", part="x" * 101)
        raise AssertionError("a long identifier was accepted")
    await refuses(c, -3, "no scan is finished", c.start("osc", parameters=["find"]))
    # A structure of another type is no recipe; a variable is not written; a type's method is not called at the type.
    with contextlib.suppress(ua.UaStatusCodeError):
        await c.call("RecipeManagement.PrepareRecipe", ua.MeasIdDataType(Id="osc"), None)
        raise AssertionError("another structure was accepted")
    with contextlib.suppress(ua.UaStatusCodeError):
        await c.node("Station.RobotArmed").write_value(True)
        raise AssertionError("a variable was written")
    name, error = await c.call("RecipeManagement.UnprepareRecipe", c.external("osc"), None)
    assert (name.Id, error) == ("osc", 0)
    await c.until_state("Operational", "Initialized")
    assert (jobs(s), moves()) == before and await c.automatic() == "Initialized"


async def person(op):
    """A person at the screen who confirms every motion, until the caller says so."""
    over, confirmed = threading.Event(), []
    thread = threading.Thread(target=lambda: confirmed.extend(op.confirms(over)), daemon=True)
    thread.start()

    async def leaves():
        over.set()
        await asyncio.to_thread(thread.join, 120)
        return confirmed

    return leaves


async def ready(c, part):
    if await c.automatic() == "Ready":
        await c.call("RecipeManagement.UnprepareRecipe", c.external(await c.shown("PreparedRecipe")), None)
    assert (await c.prepare(part))[-1] == 0


async def inserted(c, g, s, op, part, first):
    """An insertion that a client starts and a person confirms."""
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/simulated", {"holds": part})
    op.arm()
    await c.until_shown("RobotArmed", bool)
    seen = c.forget()
    await ready(c, part)
    # A state that was there for less than a sampling interval is an event, and no change of a value.
    await settled(lambda: "RecipePreparedEventType" in [n for n, _ in seen.events])
    seen = c.forget()
    begun, before = len(events(folder)), moves()
    job, error = await c.start(part, meas="m-1", part=f"board-7/{part}", parameters=[f"sweep_mm={SWEEP}"])
    assert error == 0, (error, await c.shown("LastRefusalWords"))
    name = s.json("GET", "/jobs")[0]["id"]
    assert job.Id == str(int(name.split("-")[0])), (job, name)
    await c.until_state("Operational", "SingleExecution")
    await c.until_shown("AwaitsConfirmation", lambda asks: asks == "touch")
    if first:
        await asyncio.to_thread(attack, g, await second(c, g), s)
        # Whatever was asked for, nothing moved and no other job came.
        assert moves() == before and s.json("GET", "/jobs")[0]["id"] == name
        assert await c.shown("AwaitsConfirmation") == "touch" and await c.automatic() == "SingleExecution"
    leaves = await person(op)
    try:
        await c.until_state("Operational", "Ready", seconds=600)
    finally:
        confirmed = await leaves()
    stored = s.json("GET", f"/jobs/{name}")
    assert stored["state"] == "done", stored
    await settled(
        lambda: {"JobStartedEventType", "ResultReadyEventType", "ReadyEventType"} <= {n for n, _ in seen.events}
    )
    states = [v for n, v in seen.values if n == "automatic"]
    # The state before is told late where nothing else happened.
    assert states[-2:] == ["SingleExecution", "Ready"] and set(states[:-2]) <= {"Initialized", "Ready"}, states
    asked = [v for n, v in seen.values if n == "asks" and v]
    assert asked == ["touch", "scan", "approach", "insert", "retract"], (asked, confirmed)
    phases = [v for n, v in seen.values if n == "phase" and v]
    assert phases[-4:] == ["approach", "insert", "retract", "inserted"], phases
    told = [n for n, _ in seen.events]
    assert (
        told.count("JobStartedEventType") == told.count("ResultReadyEventType") == told.count("ReadyEventType") == 1
    ), told
    transitions = [e.Message.Text for n, e in seen.events if n == "StateChangedEventType"]
    assert transitions == ["ReadyToSingleExecution", "SingleExecutionToReadyAuto"], transitions
    ready_event = next(e for n, e in seen.events if n == "ResultReadyEventType")
    assert ready_event.ResultId.Id == job.Id and ready_event.ResultState == 1, ready_event
    # The same numbers as the screen's.
    found = stored["outcome"]["found"]
    handle, result, error = await c.result_of(job.Id)
    assert error == 0 and result.ResultState == 1 and result.JobId.Id == job.Id, result
    assert (result.PartId.Id, result.MeasId.Id, result.ExternalRecipeId.Id) == (f"board-7/{part}", "m-1", part), result
    assert result.ProcessingTimes.StartTime <= result.ProcessingTimes.EndTime == result.CreationTime
    content = [v.Value if isinstance(v, c_ua().Variant) else v for v in result.ResultContent]
    plain = [await c.result(n) for n in clients.CONTENT]
    assert len(content) == len(plain) and all(clients.same(a, b) for a, b in zip(content, plain)), (content, plain)
    for which, pose in (("Pose", "insertion"), ("Approach", "approach"), ("Retract", "retract")):
        assert near(await c.result(which), found["poses"][pose]), (which, await c.result(which), found["poses"])
    sigma = [*(await c.result("SigmaMm")), *(await c.result("SigmaDeg"))]
    assert all(abs(a - b) <= 0.000051 for a, b in zip(sigma, [*found["sigma_mm"], *found["sigma_deg"]])), (sigma, found)
    judged = await c.result("GatesJudged")
    assert set(judged) == {g["name"] for g in found["gates"]} and judged == await c.result("GatesPassed"), judged
    assert await c.result("Found") == 1 and abs(await c.result("Score") - found["score"]) < 0.001
    # The cell's own truth.
    log = [e for e in await settled(lambda: [e for e in events(folder)[begun:] if e["what"] == "released"])]
    assert len(log) == 1 and log[0]["inserted"], log
    assert not any(e["what"] == "collision" for e in events(folder)[begun:])
    print(
        f"{part}: inserted {log[0]['lateral_mm']:.3f} mm aside, {len(seen.values)} changes seen, questions {confirmed}"
    )


def near(a, b):
    """Equal to the units of the registers; an angle may have gone round."""
    return len(a) == 6 and all(
        abs(x - y) <= 0.00051 or k > 2 and abs(abs(x - y) - 360) < 0.001 for k, (x, y) in enumerate(zip(a, b))
    )


async def second(c, g):
    """A second client sees the same and starts nothing while a job runs; when it goes, nothing changes. Returns what it
    sent."""
    async with Client(g.url, records=True) as other:
        assert await other.automatic() == "SingleExecution" and await other.shown("AwaitsConfirmation") == "touch"
        await refuses(other, -6, "a job runs", other.start("osc"))
        await invalid(other.prepare("osc"))
    assert await c.automatic() == "SingleExecution"
    return other.recorded


def attack(g, recorded, s):
    """Foreign bytes, changed messages, many connections: the client is served meanwhile and afterwards."""
    chance = random.Random(11)
    host, port = "127.0.0.1", g.port
    hello = clients.hello(g.url)
    # A whole session as a client sent it: hello, channel, session, reads.
    recorded = recorded[:40]
    assert recorded[0].startswith(b"HELF") and recorded[1].startswith(b"OPNF") and len(recorded) == 40
    answered = 0
    for k in range(FRAMES):
        if k % 100 == 0:
            # The screen stays, which is let go when it is silent for a minute.
            s.json("POST", "/lease", {})
        if k % 3 == 0:
            frame = chance.randbytes(chance.randrange(1, 400))
        elif k % 3 == 1:
            frame = bytearray(b"".join(recorded[: chance.randrange(2, 12)]))
            for _ in range(chance.randrange(1, 8)):
                frame[chance.randrange(len(recorded[0]), len(frame))] = chance.randrange(256)
        else:
            # A header that is right, and a body of chance: it passes the gate.
            body = chance.randbytes(chance.randrange(0, 200))
            kind = chance.choice([b"OPNF", b"MSGF", b"MSGC", b"CLOF"])
            frame = hello + kind + (8 + len(body)).to_bytes(4, "little") + body
        with socket.create_connection((host, port), 10, ("127.0.0.2", 0)) as wire:
            wire.settimeout(10)
            with contextlib.suppress(ConnectionResetError, BrokenPipeError):
                wire.sendall(frame)
                wire.shutdown(socket.SHUT_WR)
                while got := wire.recv(4096):
                    answered += got.startswith(b"ACKF")
    assert answered > FRAMES / 4, f"{answered} of {FRAMES} reached the server"
    # Connections of one machine are counted, and leave places for others.
    wires = [socket.create_connection((host, port), 10, ("127.0.0.3", 0)) for _ in range(20)]
    said = []
    for wire in wires:
        wire.settimeout(0.2)
        with contextlib.suppress(TimeoutError, ConnectionResetError):
            said.append(wire.recv(200))
    assert len([x for x in said if x.startswith(b"ERRF") and b"of this machine" in x]) == 12, said
    for wire in wires:
        wire.close()
    assert g.process.poll() is None and "panicked" not in g.said(), g.said()


async def ends(c, s, op):
    """A job that the client stops, one that it aborts, one that the person refuses, one that the screen starts."""

    async def begins():
        op.arm()
        await c.until_shown("RobotArmed", bool)
        await ready(c, "osc")
        c.forget()
        job, error = await c.start("osc", parameters=[f"sweep_mm={SWEEP}"])
        assert error == 0, await c.shown("LastRefusalWords")
        return job.Id, await asyncio.to_thread(op.asked, "touch")

    async def ended(job, transition, state, code):
        await c.until_state("Operational", "Ready")
        assert await c.last_transition() == transition, await c.last_transition()
        await c.until_result(job)
        stored = s.json("GET", "/jobs")[0]
        assert (await c.result("ResultState"), await c.result("Error")) == (state, code)
        assert await c.result("ErrorWords") == stored["problem"]["what"][:200] and len(await c.result("Pose")) == 0, (
            stored
        )

    before = moves()
    job, _ = await begins()
    assert await c.stop() == 0
    await ended(job, "SingleExecutionToReadyStop", 3, 12)
    s.json("POST", "/lease", {"firmly": True})
    job, _ = await begins()
    assert await c.call("VisionStateMachine.AutomaticModeStateMachine.Abort", 0, "") == 0
    await ended(job, "SingleExecutionToReadyAbort", 3, 12)
    s.json("POST", "/lease", {"firmly": True})
    job, what = await begins()
    assert op.post("/motion/refuse", what)[0] == 200
    await ended(job, "SingleExecutionToReadyAuto", 4, 4)
    assert moves() == before
    # A job of the screen is shown, without a recipe that this door could know.
    op.arm()
    s.json("POST", "/jobs", {"procedure": "insert", "recipe": "osc", "sweep_mm": 20}, tab="tests")
    await c.until_state("Operational", "SingleExecution")
    assert await c.last_transition() == "ReadyToSingleExecutionAuto"
    await refuses(c, -6, "a job runs", c.start("osc"))
    # Halt stops it, and Reset leads back.
    assert await c.call("VisionStateMachine.Halt", 1, "end of the shift") == 0
    await c.until_state("Halted")
    stored = await settled(
        lambda: (lambda j: j if j["state"] not in ("queued", "running") else None)(s.json("GET", "/jobs")[0])
    )
    assert stored["state"] == "stopped", stored
    await c.until_result(str(int(stored["id"].split("-")[0])))
    assert await c.result("Recipe") == "" and await c.result("ResultState") == 3
    await invalid(c.prepare("osc"))
    assert await c.call("VisionStateMachine.Reset", 0, "") == 0
    await c.until_state("Preoperational")
    complete, count, handle, listed, error = await c.results()
    assert complete and error == 0 and count == len(listed) >= len(PARTS) + 4, (count, len(listed))
    assert [r.ResultState for r in listed][-1] == 1 and {r.ResultState for r in listed[:4]} == {3, 4}, listed
    complete, count, _, listed, _ = await c.results(most=2, start=1)
    assert (complete, count) == (False, 2)
    _, count, _, listed, _ = await c.results(state=1, part=f"board-7/{PARTS[0]}")
    assert count == 1 and listed[0].ExternalRecipeId.Id == PARTS[0], listed
    apart = await c.call(
        "ResultManagement.GetResultComponentsById", c_ua().ResultIdDataType(Id=listed[0].ResultId.Id), 0
    )
    assert (
        apart[4] == 1
        and apart[6].Id == f"board-7/{PARTS[0]}"
        and len(apart[15]) == len(clients.CONTENT)
        and apart[-1] == 0
    ), apart


async def lost(c, s, op):
    """The station is killed while a job runs: Error, and when it is back nothing goes on."""
    await c.call("VisionStateMachine.SelectModeAutomatic")
    s.json("POST", "/lease", {"firmly": True})
    op.arm()
    await c.until_shown("RobotArmed", bool)
    await ready(c, "osc")
    job, error = await c.start("osc")
    assert error == 0
    await asyncio.to_thread(op.asked, "touch")
    port = door(s).rsplit(":", 1)[1]
    before, known = moves(), jobs(s)
    s.kill()
    await c.until_state("Error")
    assert await c.shown("Connected") is False and await c.automatic() is None and await c.shown("JobState") == "none"
    await invalid(c.start("osc"))
    again = await asyncio.to_thread(Server, sheetlight, folder, "--simulate", "--set", "none", "--modbus", port)
    await c.until_state("Preoperational")
    assert await c.shown("Connected") is True and await c.shown("PreparedRecipe") == ""
    await c.until_result(job.Id)
    assert (await c.result("ResultState"), await c.result("Error"), await c.result("Recipe")) == (3, 15, "osc")
    await invalid(c.start("osc"))
    assert jobs(again) == known and moves() == before
    assert again.end() == 0
    await c.until_state("Error")


async def strangers(s):
    """With certificates and a login: who has neither stays outside."""
    ua = c_ua()
    pki, login = os.path.join(folder, "pki"), os.path.join(folder, "login")
    with open(login, "w") as f:
        f.write("plc\nsecret word\n")
    begun = time.monotonic()
    g = await asyncio.to_thread(Gateway, program, door(s), "--pki", pki, "--login", login)
    print(f"a key pair was made within {time.monotonic() - begun:.1f} s")
    assert all(os.stat(p).st_mode & 0o077 == 0 for p in (pki, os.path.join(pki, "private")))
    certificate, key = clients.certificate(folder)

    async def tried(**how):
        try:
            async with Client(g.url, **how) as c:
                return await c.state()
        except (ua.UaError, ConnectionError, asyncio.TimeoutError, TimeoutError) as e:
            return e

    secured = {"security": f"Basic256Sha256,SignAndEncrypt,{certificate},{key}"}
    right = {"user": "plc", "password": "secret word"}
    for how in ({}, right, secured, {**secured, **right}):
        assert isinstance(await tried(**how), Exception), how
    # The certificate of the last one lies where a person looks at it; trusted, it gets in with the right password.
    (rejected,) = os.listdir(os.path.join(pki, "rejected"))
    os.rename(os.path.join(pki, "rejected", rejected), os.path.join(pki, "trusted", rejected))
    assert isinstance(await tried(**secured, user="plc", password="secret"), Exception)
    assert isinstance(await tried(**secured), Exception), "anonymous"
    for policy in ("Basic256Sha256,SignAndEncrypt", "Basic256Sha256,Sign", "Aes256Sha256RsaPss,SignAndEncrypt"):
        got = await tried(security=f"{policy},{certificate},{key}", **right)
        assert got == "Preoperational", (policy, got)
    assert "panicked" not in g.said(), g.said()
    assert g.end() == 0


async def guided():
    """A station whose robot the client moves: shots and errors pass through."""
    port = clients.free_port()
    out = subprocess.run(
        [
            sheetlight,
            "--quiet",
            "simulate",
            "--out",
            os.path.join(folder, "guided"),
            "--set",
            "surface",
            "--width",
            "320",
        ],
        capture_output=True,
        text=True,
    )
    assert out.returncode == 0, out
    station = os.path.join(folder, "guided", "station")
    words = [
        "robot",
        "serve",
        "--protocol",
        "modbus",
        "--station",
        station,
        "--camera",
        "sim:3?still=0.5&size=320x240",
        "--recipes",
        os.path.join(folder, "recipes"),
        "--out",
        os.path.join(folder, "scans"),
        "--listen",
        f"127.0.0.1:{port}",
        "--notation",
        "denso",
        "--on",
        "cpu",
    ]
    served = subprocess.Popen([sheetlight, *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    g = Gateway(program, f"127.0.0.1:{port}")
    try:
        async with Client(g.url) as c:
            await c.until_state("Preoperational")
            assert await c.shown("RunsJobs") is False and await c.shown("Connected") is True
            await c.call("VisionStateMachine.SelectModeAutomatic")
            await ready(c, "osc")
            await invalid(c.call("Station.AddPose", clients.doubles([300.0, 0, 400.0, 180.0, 0, 180.0])))
            job, error = await c.start("osc", part="p-1")
            assert (job.Id, error) == ("scan-1", 0), (job, error)
            for k in range(3):
                shots, error = await c.call(
                    "Station.AddPose", clients.doubles([300.0, 0.5 * k, 400.0, 180.0, 0, 180.0])
                )
                assert (shots, error) == (k + 1, 0), (shots, error, await c.shown("LastRefusalWords"))
            shots, error = await c.call("Station.AddPose", clients.doubles([0.3, 0, 0.4, 180.0, 0, 180.0]))
            assert (shots, error) == (3, -2), (shots, error)
            assert await c.call("Station.FindPart") == -4
            await c.until_state("Operational", "Ready")
            assert (await c.result("ResultId"), await c.result("ResultState"), await c.result("Error")) == (
                "scan-1",
                4,
                4,
            )
            assert await c.result("PartId") == "p-1" and len(await c.result("Pose")) == 0
            # Stop ends a scan here; the station has none.
            assert (await c.start("osc"))[1] == 0
            assert await c.stop() == 0
            await c.until_state("Operational", "Ready")
            assert await c.result("ResultState") == 3 and await c.last_transition() == "SingleExecutionToReadyStop"
        assert g.end() == 0
    finally:
        served.kill()


async def cell():
    s = await asyncio.to_thread(
        Server, sheetlight, folder, "--simulate", "--set", "none", "--speed", speed, "--modbus", "0"
    )
    op = Operator(s)
    g = Gateway(program, door(s), *(w for p in PARTS for w in ("--recipe", p)))
    async with Client(g.url) as c:
        await c.watch()
        told = await c.watch_results()
        await refusals(c, s)
        for k, part in enumerate(PARTS):
            await inserted(c, g, s, op, part, k == 0)
        await ends(c, s, op)
        # Every result once, and no other event.
        await settled(lambda: len(told) == len(PARTS) + 4)
        assert sorted(told, key=int) == told and len(set(told)) == len(told), told
        await strangers(s)
        await lost(c, s, op)
    assert "is reached again" in g.said() and "panicked" not in g.said(), g.said()
    peak = g.peak_mb()
    print(f"the server held {peak:.0f} MB at most")
    assert peak < 120, peak
    assert g.end() == 0


def timed(what):
    begun = time.monotonic()
    if asyncio.iscoroutine(what):
        asyncio.run(what)
    print(f"{time.monotonic() - begun:.1f} s")


if not clients.present():
    print("asyncua is not here (make python)")
    sys.exit(77)
os.makedirs(os.path.join(folder, "recipes"), exist_ok=True)
misused()
timed(nobody())
timed(guided())
timed(cell())
