"""In: the program, a simulated station, Eclipse Mosquitto as the broker, pysparkplug as the host application. Out: failure if
births lack a metric of docs/connections.md or its unit, if data skip a number, repeat a value or differ from the screen's own
interface, if a lost station is not declared dead, or if a message from outside changes more than that a birth comes again.
Frame and unit: ms since 1970, s."""

import json
import os
import random
import re
import subprocess
import sys
import threading
import time

from mosquitto import LOGIN, Folder, Mosquitto, alarmed, connected, free_port, installed
from server import Server
from waits import until

try:
    import pysparkplug
    from paho.mqtt import client as paho
    from pysparkplug import DataType, Metric, MessageType, NCmd, QoS, Topic
    from pysparkplug._protobuf import Payload
except ImportError as e:
    # The environment inside the other one: this package asks for another paho-mqtt (tools/python-env.sh).
    inner = os.path.join(sys.prefix, "sparkplug", "bin", "python")
    if not os.path.exists(inner) or os.path.realpath(sys.prefix) == os.path.realpath(os.path.join(inner, "..", "..")):
        print(f"{e} (make python)")
        sys.exit(77)
    os.execv(inner, [inner, *sys.argv])

program, folder = sys.argv[1:3]
GROUP, NODE = "Ulm plant", "cell-3"
REBIRTH = "Node Control/Rebirth"
DOCUMENT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "connections.md")


def topic(kind):
    return Topic(group_id=GROUP, message_type=MessageType(kind), edge_node_id=NODE)


class Host(pysparkplug.Client):
    """A host application: keeps every message of the group as bytes, as fields, and as this package understands it."""

    def __init__(self, port):
        super().__init__(username=LOGIN[0], password=LOGIN[1])
        self.messages, self.wrong, self.lock, self.ready = [], [], threading.Lock(), threading.Event()
        self._client.on_subscribe = lambda *_: self.ready.set()
        self.subscribe(Topic(group_id=GROUP, message_type="#"), QoS.AT_LEAST_ONCE, lambda *_: None)
        self.connect("127.0.0.1", port=port, blocking=False)
        assert self.ready.wait(30), "the broker grants no subscription"

    def _handle_message(self, message):
        kind = message.topic.split("/")[2]
        if kind not in ("NCMD", "DCMD"):
            assert message.topic == f"spBv1.0/{GROUP}/{kind}/{NODE}", message.topic
            try:
                understood = super()._handle_message(message).payload
            except Exception as e:  # Data before the first birth: no data types are known.
                understood = None
                with self.lock:
                    self.wrong.append((kind, repr(e)))
            with self.lock:
                self.messages.append((kind, Payload.FromString(message.payload), understood, message.qos, message.retain))

    def all(self, kind=None, start=0):
        with self.lock:
            return [m for m in self.messages[start:] if kind in (None, m[0])]

    def count(self):
        with self.lock:
            return len(self.messages)

    def command(self, *metrics):
        now = int(time.time() * 1000)
        metrics = tuple(Metric(timestamp=now, name=name, datatype=kind, value=value) for name, kind, value in metrics)
        payload = NCmd(timestamp=now, metrics=metrics).encode(include_dtypes=True)
        self.raw("NCMD", payload)

    def raw(self, kind, payload, retain=False, node=NODE):
        self._client.publish(f"spBv1.0/{GROUP}/{kind}/{node}", payload, qos=1, retain=retain).wait_for_publish(30)

    def born(self, start=0):
        """The last birth, after a command if there was none."""
        if not self.all("NBIRTH", start):
            self.command((REBIRTH, DataType.BOOLEAN, True))
        return until("a birth", lambda: self.all("NBIRTH", start))[-1]


def values(understood):
    return {m.name: None if m.is_null else m.value for m in understood.metrics}


def session(payload):
    (number,) = [m for m in payload.metrics if m.name == "bdSeq"]
    assert number.WhichOneof("value") == "long_value" and number.datatype == DataType.INT64, number
    return number.long_value


def documented():
    """Name, type, unit and description of each metric, as the document has them."""
    with open(DOCUMENT) as f:
        section = f.read().split("### Sparkplug B")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `(\w+/\w+)` \| (Boolean|Int64|Double|String) \| (\w*) ?\| (.+) \|$", section, re.M)
    return [(*row, what.replace("`", "")) for *row, what in rows]


def complete(birth):
    """A birth has what the specification and the document ask for."""
    kind, payload, understood, qos, retain = birth
    assert (payload.seq, payload.HasField("seq"), qos, bool(retain)) == (0, True, 0, False), birth
    now = time.time() * 1000
    assert all(abs(m.timestamp - now) < 120_000 for m in (payload, *payload.metrics)), "a time is far from now"
    assert all(m.datatype and (m.is_null or m.WhichOneof("value")) for m in payload.metrics), payload
    found = []
    for m in payload.metrics:
        units = dict(zip(m.properties.keys, m.properties.values))
        assert set(units) <= {"engUnit", "documentation"} and all(u.type == DataType.STRING for u in units.values()), units
        texts = [units[key].string_value if key in units else "" for key in ("engUnit", "documentation")]
        found.append((m.name, DataType(m.datatype).name.title(), *texts))
    assert found[:2] == [("bdSeq", "Int64", "", ""), (REBIRTH, "Boolean", "", "")], found[:2]
    wanted = documented()
    assert len(wanted) > 40 and found[2:] == wanted, (found[2:], wanted)
    assert values(understood)[REBIRTH] is False
    return values(understood)


def followed(host, start=0):
    """Goes through all messages from a birth on: no number is missing, data have only what changed. Returns the values."""
    known, seq, data = None, None, 0
    for kind, payload, understood, qos, retain in host.all(start=start):
        assert not retain
        if kind == "NDEATH":
            assert not payload.HasField("seq") and session(payload) == known["bdSeq"] and qos == 1, payload
            known, seq = None, None
            continue
        if kind == "NBIRTH":
            known, seq = complete((kind, payload, understood, qos, retain)), 0
            continue
        assert kind == "NDATA" and known is not None, (kind, "before the birth")
        seq, data = (seq + 1) % 256, data + 1
        assert payload.seq == seq and qos == 0, (payload.seq, seq)
        changed = values(understood)
        assert changed and all(known[name] != value for name, value in changed.items()), (changed, known)
        known.update(changed)
    return known, data


def told(host, s):
    """The host has the present bar, which is published once a second."""
    bar, known = s.json("GET", "/bar"), followed(host)[0]
    return (known["Alarms/Text"], known["Shots/Seen"]) == ("\n".join(bar["alarms"]), bar["frames"]["seen"])


def agrees(host, s, start=0):
    """The values that a host has are those of the screen's own interface."""
    bar = s.json("GET", "/bar")
    known, _ = followed(host, start)
    for name, value in {
        "Station/Name": bar["station"],
        "Station/Mode": bar["mode"],
        "Robot/Linked": bar["robot"] != "no_link",
        "Robot/Armed": bar["robot"] in ("armed", "moving"),
        "Laser/On": bar["laser"],
        "Camera/Rate": None,
        "Shots/Seen": bar["frames"]["seen"],
        "Shots/Measured": bar["frames"]["measured"],
        "Calibration/Verdict": bar["calibration"] and bar["calibration"]["verdict"],
        "Calibration/ExpectedError": bar["calibration"] and bar["calibration"]["expected_mm"],
        "Alarms/Count": len(bar["alarms"]),
        "Alarms/Text": "\n".join(bar["alarms"]),
    }.items():
        assert known[name] == value, (name, known[name], value)
    assert abs(known["Disk/Free"] - bar["disk_left_gb"] * 1e9) < 1e9 and 1e7 <= known["Memory/Used"] < 1e11, known
    return known


def results(host, s):
    """Jobs reach the host when their state changes, and their results with them."""
    start = host.count()
    job = s.job({"procedure": "check"})
    until("the end of the job", lambda: followed(host)[0]["Job/State"] == "done")
    until("the bar", lambda: told(host, s))
    known = agrees(host, s)
    assert (known["Job/Id"], known["Job/Procedure"], known["Job/Error"]) == (job["id"], "check", None), known
    assert host.all("NBIRTH", start) == []
    scan = s.job({"procedure": "scan", "recording": "scan"})
    until("the scan", lambda: followed(host)[0]["Scan/Job"] == scan["id"])
    known, outcome = followed(host)[0], scan["outcome"]
    assert (known["Scan/Points"], known["Scan/Shots"]) == (outcome["points"], outcome["shots"]), known
    assert (known["Scan/Sigma"], known["Scan/Coverage"]) == (outcome["median_sigma_mm"], outcome["coverage"]), known
    find = s.job({"procedure": "find", "scans": [scan["id"]], "recipe": "led"})
    until("the part", lambda: followed(host)[0]["Result/Job"] == find["id"])
    known, part = followed(host)[0], find["outcome"]
    assert [known[f"Result/{name}"] for name in ("Recipe", "Passed", "Score", "Frame", "Complete", "WithinTolerance")] == [part[name] for name in ("recipe", "passed", "score", "frame", "complete", "within_tolerance")]
    kuka = next(n["numbers"] for n in part["poses"]["notations"] if n["name"] == "kuka")
    assert [known[f"Result/{axis}"] for axis in "XYZABC"] == kuka, (known, kuka)
    sigmas = part["sigma_mm"] + part["sigma_deg"]
    assert [known[f"Result/Sigma{axis}"] for axis in ("X", "Y", "Z", "Rx", "Ry", "Rz")] == sigmas, (known, sigmas)
    # A job that fails says why, and the last result stays.
    failed = s.job({"procedure": "scan", "recording": "scna"})
    until("the failure", lambda: followed(host)[0]["Job/State"] == "failed")
    known, data = followed(host)
    assert known["Job/Error"] == failed["problem"]["what"] and known["Result/Job"] == find["id"], known
    return find["id"], data


def quiet(host, s):
    """While nothing changes, nothing is sent: only memory, disk and age go on."""
    until("the bar", lambda: told(host, s))
    start = host.count()
    time.sleep(6)
    sent = [name for m in host.all(start=start) for name in values(m[2])]
    assert set(sent) <= {"Memory/Used", "Disk/Free", "Calibration/Age"}, sent


def is_rebirth(payload):
    try:
        metrics = Payload.FromString(payload).metrics
    except Exception:
        return False
    return any(m.name == REBIRTH and m.boolean_value for m in metrics)


def mutated(rng, valid):
    """A command with one to three faults: bits, cuts, foreign bytes, parts twice."""
    text = bytearray(valid)
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(text)) if text else 0
        match rng.randrange(5):
            case 0 if text:
                text[at] ^= 1 << rng.randrange(8)
            case 1:
                del text[at:]
            case 2:
                text[at:at] = rng.randbytes(rng.randint(1, 9))
            case 3 if text:
                text[at] = rng.randrange(256)
            case _:
                text += text[at:]
    return bytes(text)


def commands(host, s):
    """Only a rebirth is obeyed, once a second at most. Anything else changes nothing."""
    jobs = s.json("GET", "/jobs")
    start = host.count()
    before = followed(host)[0]["bdSeq"]
    host.command((REBIRTH, DataType.BOOLEAN, True))
    birth = until("the birth", lambda: host.all("NBIRTH", start))[0]
    assert complete(birth)["bdSeq"] == before

    start, began = host.count(), time.monotonic()
    for _ in range(300):
        host.command((REBIRTH, DataType.BOOLEAN, True))
    until("the births", lambda: host.all("NBIRTH", start))
    time.sleep(3)
    births = len(host.all("NBIRTH", start))
    assert 1 <= births <= time.monotonic() - began + 1, births

    start, rng = host.count(), random.Random(7)
    now = int(time.time() * 1000)
    valid = NCmd(timestamp=now, metrics=(Metric(timestamp=now, name=REBIRTH, datatype=DataType.BOOLEAN, value=True),)).encode(include_dtypes=True)
    assert is_rebirth(valid)
    damaged = [m for m in (mutated(rng, valid) for _ in range(4000)) if not is_rebirth(m)]
    for payload in damaged:
        host._client.publish(f"spBv1.0/{GROUP}/NCMD/{NODE}", payload, qos=0)
    for name, kind, value in (
        (REBIRTH, DataType.BOOLEAN, False),
        (REBIRTH, DataType.INT64, 1),
        (REBIRTH, DataType.STRING, "true"),
        ("Node Control/Reboot", DataType.BOOLEAN, True),
        ("Robot/Armed", DataType.BOOLEAN, True),
        ("Laser/On", DataType.BOOLEAN, True),
        ("Job/Procedure", DataType.STRING, "check"),
    ):
        host.command((name, kind, value))
    # The right words at other topics, and far too long.
    for kind, node in (("DCMD", NODE), ("DCMD", f"{NODE}/x"), ("NCMD", "cell-4"), ("NCMD", f"{NODE}/x")):
        host.raw(kind, valid, node=node)
    for payload in (b"", b"x" * 3_000_000, valid * 50_000):
        host.raw("NCMD", payload)
    time.sleep(3)
    assert host.all("NBIRTH", start) == [] and host.all("NDEATH", start) == [], [m[0] for m in host.all(start=start)]
    assert s.json("GET", "/jobs") == jobs and s.json("GET", "/bar")["robot"] == "no_link"
    # It still listens.
    host.command((REBIRTH, DataType.BOOLEAN, True))
    until("the birth", lambda: host.all("NBIRTH", start))
    # A packet above the limit ends the session; the next one has the next number.
    start = host.count()
    host.raw("NCMD", b"x" * 5_000_000)
    birth = until("the birth of the next session", lambda: host.all("NBIRTH", start))[0]
    (death,) = host.all("NDEATH", start)
    assert (session(death[1]), session(birth[1])) == (before, before + 1)
    return len(damaged), births


def lives(files, port):
    more = ("--mqtt", f"mqtt://127.0.0.1:{port}", "--mqtt-sparkplug", f"{GROUP}/{NODE}", "--mqtt-login", files.file("login"))
    s = Server(program, folder, *more)
    # A broker that is missing costs nothing but an alarm.
    until("that the broker is missing", lambda: connected(s) == "0" and alarmed(s))
    assert s.job({"procedure": "check"})["state"] == "done"
    broker = Mosquitto(files, port)
    until("the broker", lambda: connected(s) == "1" and not alarmed(s))
    host = Host(port)
    birth = host.born()
    # The broker that was missing was never asked for a session.
    assert session(birth[1]) == 0, birth
    with host.lock:
        # What came before is of a session whose birth this host missed.
        host.messages[:] = host.messages[host.messages.index(birth):]
    until("the bar", lambda: told(host, s))
    agrees(host, s)
    found, data = results(host, s)
    quiet(host, s)
    damaged, births = commands(host, s)
    (link,) = s.json("GET", "/settings")["connections"]
    assert link["door"] == "mqtt" and link["problem"] is None and link["lost"] == 0 and link["sent"] >= data, link

    # The broker goes away and comes back: a session of its own, with the next number. A command that it kept is old.
    _, data = followed(host)
    host.disconnect()
    broker.end()
    until("that the broker is gone", lambda: connected(s) == "0" and alarmed(s))
    job = s.job({"procedure": "check"})
    assert job["state"] == "done"
    # The program waits while the host gets ready first.
    os.kill(s.process.pid, 19)
    broker = Mosquitto(files, port)
    host = until("the host", lambda: attempt(lambda: Host(port)))
    now = int(time.time() * 1000)
    kept = NCmd(timestamp=now, metrics=(Metric(timestamp=now, name=REBIRTH, datatype=DataType.BOOLEAN, value=True),))
    host.raw("NCMD", kept.encode(include_dtypes=True), retain=True)
    os.kill(s.process.pid, 18)
    until("the birth of the next session", lambda: host.all("NBIRTH"))
    time.sleep(3)
    until("the bar", lambda: told(host, s))
    assert len(host.all("NBIRTH")) == 1 and host.messages[0][0] == "NBIRTH", [m[0] for m in host.messages]
    known = agrees(host, s)
    assert known["bdSeq"] == 2 and known["Job/Id"] == job["id"] and known["Result/Job"] == found, known
    host.raw("NCMD", b"", retain=True)

    # A killed program is declared dead by the broker, with the number of its session.
    s.kill()
    (death,) = until("the death", lambda: host.all("NDEATH"))
    assert session(death[1]) == 2 and len(death[1].metrics) == 1, death
    followed(host)
    # A new start counts from 0, and knows the jobs of before.
    start = host.count()
    s = Server(program, folder, *more)
    until("the birth after the start", lambda: host.all("NBIRTH", start))
    until("the bar", lambda: told(host, s))
    known = agrees(host, s)
    assert known["bdSeq"] == 0 and known["Job/Id"] == job["id"] and known["Result/Job"] == found, known
    # Another client of the same name takes the connection: the death comes first, then the birth of the next session.
    start = host.count()
    with open(broker.log.name) as f:
        (name,) = set(re.findall(r" as (sheetlight-\w+) ", f.read()))
    twin = paho.Client(client_id=name)
    twin.username_pw_set(*LOGIN)
    twin.connect("127.0.0.1", port)
    birth = until("the birth after the twin", lambda: host.all("NBIRTH", start))[0]
    assert [m[0] for m in host.all(start=start)][:2] == ["NDEATH", "NBIRTH"] and session(birth[1]) == 1, host.all(start=start)
    assert s.end() == 0
    until("the death", lambda: len(host.all("NDEATH")) == 3)
    followed(host)
    assert not host.wrong, host.wrong
    host.disconnect()
    broker.end()
    print(f"Sparkplug: {data} messages of data, {damaged} damaged commands, {births} births for 300 commands")


def attempt(make):
    try:
        return make()
    except OSError:
        return None


def refusals(files):
    serve = [program, "station", "serve", "--station", files.file("station")]
    broker = ["--mqtt", "mqtt://127.0.0.1:1"]
    for words, part in (
        ([*broker, "--mqtt-sparkplug", "plant"], "no / between"),
        ([*broker, "--mqtt-sparkplug", "plant/+"], "+, #, /"),
        ([*broker, "--mqtt-sparkplug", "plant/a/b"], "+, #, /"),
        ([*broker, "--mqtt-sparkplug", "/cell3"], "0 bytes"),
        ([*broker, "--mqtt-sparkplug", "plant/cell3", "--mqtt-topic", "a"], "cannot be used with"),
        (["--mqtt-sparkplug", "plant/cell3"], "--mqtt"),
    ):
        run = subprocess.run([*serve, *words], capture_output=True, text=True, timeout=60)
        assert run.returncode != 0 and part in run.stderr, (words, run)


def main():
    if not installed():
        print("mosquitto is not installed (tools/cameras.sh)")
        sys.exit(77)
    files = Folder(folder)
    refusals(files)
    lives(files, free_port())


main()
