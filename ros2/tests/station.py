"""In: the program sheetlight-ros2, the program sheetlight, an empty folder, a part, the cell's speed, a number of foreign
requests. Out: failure if a client of ROS 2's services cannot start, follow and stop the jobs of a station under the
conditions of the screen, if it starts anything without them or moves anything itself, if answers, poses or diagnostics
differ from what the screen's own interface and the cell's truth say, or if their bytes, keys, tokens or numbers are not
those of rmw_zenoh. The client is eclipse-zenoh, messages are read with rosbags, turns are computed with scipy.
Frame and unit: mm, degrees; m where messages of ROS 2 are; s."""

import os
import random
import re
import struct
import subprocess
import sys
import threading
import time

try:
    import numpy as np
    import zenoh.ext
    from hears import Heard, attachment, ends_with, free_port, session, tokens
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    from scipy.spatial.transform import Rotation
except ImportError as e:
    print(f"a Python package is missing: {e}: tools/python-env.sh .venv files")
    sys.exit(77)

from hands import Operator
from server import Server, events
from waits import until

program, sheetlight, folder, PART, speed, foreign = sys.argv[1:7]
program, sheetlight = os.path.abspath(program), os.path.abspath(sheetlight)
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg("bool success\nstring message\n", "std_srvs/msg/Response"))
# As ROS 2 Jazzy has it.
TRIGGER = (
    "std_srvs::srv::dds_::Trigger_/RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
)
EMPTY = b"\0\1\0\0\0"
TARGETS = ["camera", "hand_eye", "laser_plane", "pointer", "axis"]
BEGUN = []
# A job of the simulated cell on a busy machine.
PATIENT = 900.0


def door(s):
    (link,) = [c for c in s.json("GET", "/settings")["connections"] if c["door"] == "modbus"]
    return link["address"]


def moves():
    """Number of motions in the cell's log, which is written shortly after them."""
    time.sleep(0.2)
    return sum(e["what"] == "move" for e in events(folder))


def jobs(s):
    return [j["id"] for j in s.json("GET", "/jobs")]


class Client:
    """Calls services as rmw_zenoh's clients do."""

    def __init__(self, at):
        self.at, self.number, self.identity = at, 0, random.Random(5).randbytes(16)

    def raw(self, service, payload=EMPTY, attached=True):
        """The replies to a request, and its number."""
        self.number += 1
        number = self.number
        head = struct.pack("<qqB", number, time.time_ns(), 16) + self.identity
        more = {"attachment": head} if attached else {}
        key = f"0/sheetlight/{service}/{TRIGGER}"
        return list(self.at.get(key, payload=payload, timeout=PATIENT, **more)), number

    def call(self, service):
        (reply,), number = self.raw(service)
        assert reply.ok, reply.err.payload.to_string()
        assert str(reply.ok.key_expr) == f"0/sheetlight/{service}/{TRIGGER}"
        seen, at, identity = attachment(reply.ok.attachment.to_bytes())
        assert (seen, identity) == (number, self.identity) and abs(at / 1e9 - time.time()) < 60
        answer = STORE.deserialize_cdr(reply.ok.payload.to_bytes(), "std_srvs/msg/Response")
        return answer.success, answer.message

    def begins(self, service):
        """Calls on a thread; returns what waits for the answer."""
        got = []
        thread = threading.Thread(target=lambda: got.append(self.call(service)), daemon=True)
        thread.start()

        def ended():
            thread.join(PATIENT)
            assert got, f"{service} was not answered"
            return got[0]

        return ended


def begun(c, s, op):
    """Calls for an insertion, and waits until its first motion is shown. Returns what waits for the answer, the job, and
    that motion."""
    known = len(jobs(s))
    ended = c.begins(f"insert/{PART}")
    until("the job", lambda: len(jobs(s)) > known)
    return ended, jobs(s)[0], op.asked("touch")


def six(words):
    """The pose of an answer."""
    return [float(x) for x in re.search(r"insertion (.+?) mm", words)[1].split()]


def statuses(heard):
    """Level, words and values of every message of diagnostics."""
    found = []
    for _, data, _, _ in list(heard.of("/diagnostics")):
        (status,) = STORE.deserialize_cdr(data, "diagnostic_msgs/msg/DiagnosticArray").status
        found.append((status.level, status.message, {v.key: v.value for v in status.values}))
    return found


def graph(at):
    """Node, topics and services appear as rmw_zenoh's own do, each with a number of its own."""
    seen = until("the tokens", lambda: (lambda t: t if len(t) == 12 else None)(tokens(at, 0)))
    zid = next(t for t in seen if "/NN/" in t).split("/")[2]
    name = lambda kind: f"{kind.replace('/', '::').replace('::msg::', '::msg::dds_::')}_/{STORE.hash_rihs01(kind)}"
    kept, once = "::,1:,:,:,,", ":1:,1:,:,:,,"
    wanted = {
        f"SS/%/%/sheetlight/%sheetlight%insert%{PART}/{TRIGGER}/::,10:,:,:,,",
        f"SS/%/%/sheetlight/%sheetlight%find%{PART}/{TRIGGER}/::,10:,:,:,,",
        f"SS/%/%/sheetlight/%sheetlight%stop/{TRIGGER}/::,10:,:,:,,",
        f"SS/%/%/sheetlight/%sheetlight%scan/{TRIGGER}/::,10:,:,:,,",
        *(f"SS/%/%/sheetlight/%sheetlight%calibrate%{t}/{TRIGGER}/::,10:,:,:,," for t in TARGETS),
        f"MP/%/%/sheetlight/%diagnostics/{name('diagnostic_msgs/msg/DiagnosticArray')}/{kept}",
        f"MP/%/%/sheetlight/%sheetlight%insertion/{name('geometry_msgs/msg/PoseStamped')}/{once}",
    }
    numbers = set()
    for tail in wanted:
        (token,) = [t for t in seen if t.endswith(f"/{tail}")]
        number = int(token.removesuffix(f"/{tail}").removeprefix(f"@ros2_lv/0/{zid}/0/"))
        numbers.add(number)
    assert len(numbers) == 11 and 0 not in numbers, numbers


def refusals(c, s):
    """What the station does not allow is refused with its number and words; foreign requests reach nothing."""
    before = (jobs(s), moves())
    good, words = c.call(f"insert/{PART}")
    assert not good and words.startswith("refused, 9: ") and "not armed" in words, words
    good, words = c.call(f"find/{PART}")
    assert not good and words.startswith("refused, 3: "), words
    for service in ("scan", *(f"calibrate/{t}" for t in TARGETS)):
        good, words = c.call(service)
        assert not good and words.startswith("refused, 10: ") and "press Operate" in words, words
    assert c.raw("insert/none")[0] == [] and c.raw("scan/none")[0] == [] and c.raw("calibrate/joint")[0] == []
    chance = random.Random(7)
    for k in range(int(foreign)):
        payload = chance.randbytes(chance.randrange(0, 200))
        if k % 4 == 0:
            payload = b"\0\1\0\0" + chance.randbytes(chance.randrange(5, 100))
        if payload[:1] == b"\0" and payload[1:2] in (b"\0", b"\1") and len(payload) <= 8:
            continue
        (reply,), _ = c.raw(f"insert/{PART}", payload, attached=k % 2 == 0)
        assert reply.ok is None and "empty request" in reply.err.payload.to_string(), payload
    # Programs of plain Zenoh send no number.
    (reply,), _ = c.raw(f"insert/{PART}", attached=False)
    assert reply.ok.attachment is None and reply.ok.payload.to_bytes()[4] == 0
    assert c.call("stop") == (True, "stopped")
    assert (jobs(s), moves()) == before


def inserted(c, at, s, op, heard):
    """An insertion that a call starts and a person confirms."""
    s.json("POST", "/lease", {"firmly": True})
    s.json("POST", "/simulated", {"holds": PART})
    op.arm()
    first, before = len(events(folder)), moves()
    ended, name, _ = begun(c, s, op)
    good, words = c.call(f"insert/{PART}")
    assert not good and words.startswith("refused, 6: "), words
    until("diagnostics", lambda: any("touch waits for a person" in words for _, words, _ in statuses(heard)))
    # Nothing moves without the person, and no other job comes.
    assert moves() == before and jobs(s)[0] == name
    over = threading.Event()
    person = threading.Thread(target=lambda: op.confirms(over), daemon=True)
    person.start()
    good, words = ended()
    over.set()
    person.join(60)
    stored = s.json("GET", f"/jobs/{name}")
    number = int(name.split("-")[0])
    assert good and words.startswith(f"job {number} done: inserted; "), (words, stored)
    assert stored["state"] == "done", stored
    # The same numbers as the screen's.
    found = stored["outcome"]["found"]
    wanted = found["poses"]["insertion"]
    assert np.allclose(six(words), wanted, atol=0.00051), (words, wanted)
    sigma = [float(x) for x in re.search(r"sigma (.+?) mm", words)[1].split()]
    assert np.allclose(sigma, [*found["sigma_mm"], *found["sigma_deg"]], atol=0.000051), (sigma, found)
    until("the pose", lambda: heard.of("/sheetlight/insertion"))
    (sample,) = heard.of("/sheetlight/insertion")
    pose = STORE.deserialize_cdr(sample[1], "geometry_msgs/msg/PoseStamped")
    p, q = pose.pose.position, pose.pose.orientation
    assert np.allclose([p.x, p.y, p.z], np.array(wanted[:3]) / 1000, atol=1e-6), (p, wanted)
    # Denso's angles turn about the fixed axes x, y, z.
    turn = Rotation.from_quat([q.x, q.y, q.z, q.w]).inv() * Rotation.from_euler("xyz", wanted[3:], degrees=True)
    assert turn.magnitude() < 1e-5, (q, wanted)
    stamp = pose.header.stamp.sec + pose.header.stamp.nanosec / 1e9
    assert pose.header.frame_id == "base_link" and abs(stamp - sample[3]) < 5
    # A later subscriber gets it too.
    late = []
    history = zenoh.ext.HistoryConfig(detect_late_publishers=True)
    subscriber = zenoh.ext.declare_advanced_subscriber(
        at, "0/sheetlight/insertion/**", lambda x: late.append(x.payload.to_bytes()), history=history
    )
    until("the kept pose", lambda: late)
    assert late == [sample[1]]
    subscriber.undeclare()
    until(
        "diagnostics of the end",
        lambda: any(v.get("job state") == "done" and v.get("job") == str(number) for _, _, v in statuses(heard)),
    )
    level, _, values = statuses(heard)[-1]
    assert level == 0 and values["components inserted"] == "1" and values["gates missed"] == "", values
    # The cell's own truth.
    log = [e for e in events(folder)[first:] if e["what"] == "released"]
    assert len(log) == 1 and log[0]["inserted"], log
    assert not any(e["what"] == "collision" for e in events(folder)[first:])
    print(f"{PART}: inserted {log[0]['lateral_mm']:.3f} mm aside; {words}")


def stopped(c, s, op):
    """A job that another call stops, and one that the person refuses."""
    before = moves()
    op.arm()
    ended, _, _ = begun(c, s, op)
    assert c.call("stop") == (True, "stopped")
    good, words = ended()
    assert not good and " stopped, error 12: " in words, words
    op.arm()
    ended, _, motion = begun(c, s, op)
    assert op.post("/motion/refuse", motion)[0] == 200
    good, words = ended()
    assert not good and " failed, error 4: " in words, words
    assert moves() == before


def lost(c, s, op, heard):
    """The station is killed while a job waits, and comes back: the call learns that its job was cut off."""
    op.arm()
    ended, _, _ = begun(c, s, op)
    port, before, known = door(s).rsplit(":", 1)[1], moves(), jobs(s)
    s.kill()
    until("diagnostics", lambda: statuses(heard)[-1][0] == 2 and "not reached" in statuses(heard)[-1][1])
    good, words = c.call(f"insert/{PART}")
    assert not good and "nothing was asked" in words, words
    again = Server(sheetlight, folder, "--simulate", "--set", "none", "--modbus", port)
    good, words = ended()
    assert not good and " cut off, error 15: " in words, words
    assert jobs(again) == known and moves() == before
    assert again.end() == 0


def made(c, s):
    """Scans and calibrations from recordings, as the screen's own records have them. Nothing is accepted."""
    station = os.path.join(s.station, "calibration", "camera.json")
    with open(station, "rb") as f:
        before = f.read()
    s.json("POST", "/lease")
    known = jobs(s)
    # None of the recordings has boards on an axis; one that is named is there, and the job says why it cannot use it.
    good, words = c.call("calibrate/axis")
    assert not good and words.startswith("refused, 4: no complete recording of boards"), words
    assert jobs(s) == known
    good, words = c.call("scan/intrinsics")
    job = s.json("GET", "/jobs")[0]
    assert not good and " failed, error " in words and words.endswith("; recording intrinsics"), words
    assert job["problem"]["what"][:60] in words, (job["problem"], words)
    s.json("POST", "/lease")
    good, words = c.call("calibrate/camera")
    job = s.json("GET", "/jobs")[0]
    wanted = f"job {int(job['id'].split('-')[0])} done: camera calibrated from intrinsics; {job['outcome']['verdict']}; "
    assert good and words == wanted + "a person has to accept it at the screen", (words, job)
    assert job["order"]["target"] == "camera" and job["outcome"]["accepted"] is False, job
    with open(station, "rb") as f:
        assert f.read() == before, "a calibration was stored that nobody accepted"
    for service in ("scan/scan", "scan"):
        s.json("POST", "/lease")
        good, words = c.call(service)
        job = s.json("GET", "/jobs")[0]
        o, number = job["outcome"], int(job["id"].split("-")[0])
        assert good and words == f"job {number} done: scanned scan; {o['shots']} shots, {o['points']} points", (words, o)
    print(words)


def found(address, at):
    """The part of a recipe is found in the last scan of the screen, or it is not; nothing can be inserted there."""
    recorded = os.path.join(folder, "recorded")
    subprocess.run([sheetlight, "--quiet", "simulate", "--out", recorded, "--set", "scan,intrinsics"], check=True, stdout=subprocess.DEVNULL)
    s = Server(sheetlight, recorded, "--recordings", recorded, "--modbus", "0")
    heard, c = Heard(at), Client(at)
    node = begin(s, address, "led", "dimm", recordings=["scan", "intrinsics", "scan"])
    until("the station", lambda: any(v for _, _, v in statuses(heard)))
    made(c, s)
    scan = s.json("GET", "/jobs")[0]
    good, words = c.call("insert/led")
    assert not good and words.startswith("refused, 9: "), words
    s.json("POST", "/lease")
    good, words = c.call("find/led")
    assert s.json("GET", "/jobs")[0]["order"]["scans"] == [scan["id"]]
    outcome = s.json("GET", "/jobs")[0]["outcome"]
    assert good and ": found; " in words, (words, outcome)
    # A station without [tool] states its poses as matrices.
    wanted = np.reshape(outcome["poses"]["insertion"], (4, 4))
    assert np.allclose(six(words)[:3], wanted[:3, 3], atol=0.00051), (words, wanted)
    until("the pose", lambda: heard.of("/sheetlight/insertion"))
    pose = STORE.deserialize_cdr(heard.of("/sheetlight/insertion")[0][1], "geometry_msgs/msg/PoseStamped").pose
    q = pose.orientation
    turn = Rotation.from_quat([q.x, q.y, q.z, q.w]).inv() * Rotation.from_matrix(wanted[:3, :3])
    assert turn.magnitude() < 1e-5, (q, wanted)
    time.sleep(0.5)
    assert len(heard.of("/sheetlight/insertion")) == 1, "a pose was sent again"
    good, words = c.call("find/dimm")
    assert not good and "; insertion" not in words, words
    time.sleep(0.5)
    assert len(heard.of("/sheetlight/insertion")) == 1
    # A program that starts later does not pass an old pose off as a new one; a recipe that is named twice has one service of each kind.
    ends(node)
    node = begin(s, address, "led", "led")
    count = len(heard.of("/diagnostics"))
    until("the station", lambda: any(v for _, _, v in statuses(heard)[count:]))
    assert s.job({"procedure": "find", "recipe": "led", "scans": [scan["id"]]})["state"] == "done"
    until("the new pose", lambda: len(heard.of("/sheetlight/insertion")) > 1)
    ends(node)
    node = begin(s, address, "led", "led")
    count = len(heard.of("/diagnostics"))
    until("the station", lambda: any(v for _, _, v in statuses(heard)[count:]))
    # The node, nine services, two topics.
    assert len(tokens(at, 0)) == 12, tokens(at, 0)
    time.sleep(1.0)
    assert len(heard.of("/sheetlight/insertion")) == 2, "an old pose was sent"
    ends(node)
    assert s.end() == 0
    heard.subscriber.undeclare()


def begin(s, address, *recipes, recordings=()):
    """A node that shows the station."""
    words = ["--station", door(s), "--notation", "denso", "--frame", "base_link", "--connect", address]
    words += [w for r in recipes for w in ("--recipe", r)] + [w for r in recordings for w in ("--recording", r)]
    BEGUN.append(subprocess.Popen([program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE))
    return BEGUN[-1]


def ends(node):
    """What a node printed until it was told to end."""
    node.terminate()
    out, err = node.communicate(timeout=30)
    assert node.returncode == 0 and b"panicked" not in err, (node.returncode, out, err)
    return out, err


def main():
    s = Server(sheetlight, folder, "--simulate", "--set", "none", "--speed", speed, "--modbus", "0")
    address = f"tcp/127.0.0.1:{free_port()}"
    router = session("router", listen=address)
    at = session("client", connect=address)
    heard = Heard(at)
    node = begin(s, address, PART)
    graph(at)
    until("the station", lambda: statuses(heard) and statuses(heard)[-1][0] == 0)
    c, op = Client(at), Operator(s)

    def over():
        out, err = ends(node)
        assert b"service /sheetlight/stop" in out and b"the station is not reached" in err, (out, err)
        until("the end of the node", lambda: not tokens(at, 0))
        heard.subscriber.undeclare()

    began = time.monotonic()
    for name, check in [
        ("refusals", lambda: refusals(c, s)),
        ("inserted", lambda: inserted(c, at, s, op, heard)),
        ("stopped", lambda: stopped(c, s, op)),
        ("lost", lambda: lost(c, s, op, heard)),
        ("over", over),
        ("found", lambda: found(address, at)),
    ]:
        check()
        print(f"{name}: {time.monotonic() - began:.1f} s")
        began = time.monotonic()
    at.close()
    router.close()


ends_with(main, BEGUN)
