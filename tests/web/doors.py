"""In: the program, a simulated station. Out: failure if the server accepts a request that it must refuse, if a viewer
slows it down, or if a killed server loses or invents a job.
Frame and unit: bytes, seconds, MB."""

import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import time

from recordings import longer
from server import Server, frame
from waits import PATIENCE, until

program, folder = sys.argv[1:3]
# Reads the figures, and nothing else.
FIGURES = "figures-0123456789-abcdefghij"


def refused(what, status):
    assert 400 <= status < 500, f"{what}: {status}, a 4xx was wanted"


def who_gets_in(s):
    ok, head, _ = s.ask("GET", "/", token=False)
    assert ok == 200 and "default-src 'none'" in head["content-security-policy"], (ok, head)
    for needed in ("x-content-type-options", "referrer-policy", "x-frame-options", "cross-origin-resource-policy"):
        assert needed in head, needed
    assert s.ask("GET", "/api/v1/bar")[0] == 200
    port = s.host.rsplit(":", 1)[1]
    assert s.ask("GET", "/api/v1/bar", host=f"localhost:{port}")[0] == 200
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", f"127.0.0.1:{int(port) - 1}", ""):
        refused(f"host {host!r}", s.ask("GET", "/api/v1/bar", host=host or " ")[0])
        refused(f"page for host {host!r}", s.ask("GET", "/", host=host or " ")[0])
    for origin in ("http://evil.example", "null", f"https://{s.host}", f"http://127.0.0.1:{int(port) + 1}", f"http://{s.host}.evil.example"):
        refused(f"origin {origin}", s.ask("POST", "/api/v1/lease", {}, Origin=origin)[0])
        refused(f"socket of origin {origin}", s.socket(Origin=origin)[0])
    assert s.ask("POST", "/api/v1/lease", {}, Origin=f"http://{s.host}")[0] == 200
    refused("another site's fetch", s.ask("GET", "/api/v1/bar", Sec_Fetch_Site="cross-site")[0])
    for token in (False, "", "0" * 32, s.token[:-1], s.token + "0", s.token.upper() + "x"):
        refused(f"token {token!r}", s.ask("GET", "/api/v1/bar", token=token)[0])
        refused(f"socket with token {token!r}", s.socket(token=token)[0])
    refused("a wrong knock", s.ask("POST", "/api/v1/session", {"token": "0" * 32}, token=False)[0])
    refused("a password where there is none", s.ask("POST", "/api/v1/session", {"password": ""}, token=False)[0])
    status, head, _ = s.ask("POST", "/api/v1/session", {"token": s.token}, token=False)
    cookie = head["set-cookie"]
    assert status == 200 and "HttpOnly" in cookie and "SameSite=Strict" in cookie, cookie
    assert s.ask("GET", "/api/v1/bar", token=False, Cookie=cookie.split(";")[0])[0] == 200
    refused("a cookie of another value", s.ask("GET", "/api/v1/bar", token=False, Cookie=cookie.split(";")[0][:-4] + "0000")[0])
    return cookie.split(";")[0]


def figures(s):
    """What Prometheus scrapes is read by its own parser, and says what the other routes say."""
    refused("figures without a token", s.ask("GET", "/api/v1/metrics", token=False)[0])
    assert s.ask("GET", "/api/v1/metrics")[0] == 200
    for path in ("bar", "metrics/"):
        refused(f"{path} with the figures' token", s.ask("GET", f"/api/v1/{path}", token=FIGURES)[0])
    for path in ("stop", "lease"):
        refused(f"{path} with the figures' token", s.ask("POST", f"/api/v1/{path}", {}, token=FIGURES)[0])
    refused("figures with another token", s.ask("GET", "/api/v1/metrics", token=FIGURES[:-1])[0])
    status, head, body = s.ask("GET", "/api/v1/metrics", token=FIGURES)
    assert status == 200 and head["content-type"].startswith("text/plain; version=0.0.4"), (status, head)
    try:
        from prometheus_client.parser import text_string_to_metric_families
    except ImportError:
        print("*** SKIPPED: no prometheus-client here: the figures are not parsed ***")
        return
    all_ = {f.name: f for f in text_string_to_metric_families(body.decode())}
    one = lambda name: [x.value for x in all_[name].samples]
    jobs = json.loads(s.ask("GET", "/api/v1/jobs")[2])
    counted = {(x.labels["procedure"], x.labels["state"]): x.value for x in all_.get("sheetlight_jobs").samples}
    for (procedure, state), n in counted.items():
        assert n == sum(j["order"]["procedure"] == procedure and j["state"] == state for j in jobs), (procedure, state)
    assert sum(counted.values()) == len(jobs) > 0, counted
    bar = json.loads(s.ask("GET", "/api/v1/bar")[2])
    assert abs(one("sheetlight_disk_free_bytes")[0] / 1e9 - bar["disk_left_gb"]) < 1, bar["disk_left_gb"]
    assert one("sheetlight_robot_linked") == [0] and one("sheetlight_job_running") == [0]
    # What is unknown is missing: a simulated station's calibrations are exact and expect nothing.
    figure, expected = all_.get("sheetlight_calibration_expected_error_mm"), bar["calibration"]["expected_mm"]
    assert (figure is None) == (expected is None), (figure, expected)
    assert figure is None or abs(figure.samples[0].value - expected) < 1e-9, (figure, expected)
    verdict = all_["sheetlight_calibration_worst_verdict"].samples[0].labels
    assert verdict == {"verdict": bar["calibration"]["verdict"], "of": bar["calibration"]["worst"]}, verdict
    (info,) = all_["sheetlight_build_info"].samples
    assert info.labels["station"] == bar["station"], info
    print(f"{len(all_)} families of figures")


def names(s, job):
    tricks = [
        "..", "../station.toml", "%2e%2e/%2e%2e/station.toml", "..%2f..%2fstation.toml", "/etc/passwd", "%2fetc%2fpasswd", "scan/../../job.json",
        "scan%00.png", "scan/cloud.ply%00", "link.json", "up/station.toml", ".hidden.json", "scan\\..\\job.json", "~/x.json", "scan.lock", "%c0%ae%c0%ae/x.json",
    ]
    jobs = os.path.join(folder, "station", "jobs")
    os.symlink("/etc/passwd", os.path.join(jobs, job, "link.json"))
    os.symlink(folder, os.path.join(jobs, job, "up"))
    for trick in tricks:
        status, _, body = s.ask("GET", f"/api/v1/jobs/{job}/files/{trick}")
        refused(f"file {trick}", status)
        assert b"root:" not in body and b"extraction" not in body, trick
        refused(f"recording {trick}", s.ask("GET", f"/api/v1/picture?recording={trick}&frame=0")[0])
        refused(f"page {trick}", s.ask("GET", f"/{trick}", token=False)[0])
        refused(f"recipe {trick}", s.ask("PUT", f"/api/v1/recipes/{trick}", {"name": "x", "text": ""})[0])
    for name in ("../x", "0001-scan/..", "0001", "../../etc", "0001-scan%00", "9999-scan", "%2e%2e"):
        refused(f"job {name}", s.ask("GET", f"/api/v1/jobs/{name}")[0])
        refused(f"map of {name}", s.ask("GET", f"/api/v1/scans/{name}/map")[0])
    for recording in ("../station", "/etc", "scan/..", "scan\0", "nothing"):
        ended = s.job({"procedure": "scan", "recording": recording})
        assert ended["state"] == "failed", ended
    # A pose file that would do lies beside the recording.
    others = shutil.copy(os.path.join(folder, "scan", "poses.json"), os.path.join(folder, "others.json"))
    picture = os.path.join(folder, "scan", "ambient.png")
    for extra in ({"poses": "../others"}, {"poses": "/etc/passwd"}, {"ambient": ["../station/x.png"]}, {"ambient": ["/etc/passwd"]}, {"ambient": [picture]}):
        ended = s.job({"procedure": "scan", "recording": "scan", **extra})
        assert ended["state"] == "failed" and ended["problem"]["kind"] in ("input", "usage"), (extra, ended)
    os.unlink(others)
    os.unlink(os.path.join(jobs, job, "link.json"))
    os.unlink(os.path.join(jobs, job, "up"))


def bodies(s):
    refused("a body of 1 GB by its length", s.ask("POST", "/api/v1/jobs", b"{", Content_Length=str(1 << 30))[0])
    name, port = s.host.rsplit(":", 1)
    # The same body without a stated length: sent in chunks until the server refuses it.
    with socket.create_connection((name, int(port)), timeout=PATIENCE) as c:
        c.sendall(f"POST /api/v1/jobs HTTP/1.1\r\nHost: {s.host}\r\nAuthorization: Bearer {s.token}\r\nX-Sheetlight-Tab: tests\r\nTransfer-Encoding: chunked\r\n\r\n".encode())
        sent, answer = 0, b""
        try:
            while sent < 1 << 30:
                c.sendall(b"10000\r\n" + b"x" * 65536 + b"\r\n")
                sent += 65536
                c.settimeout(0.0001)
                try:
                    answer = c.recv(4096)
                    break
                except (TimeoutError, BlockingIOError):
                    c.settimeout(PATIENCE)
        except (BrokenPipeError, ConnectionResetError):
            pass
        assert sent < 64 << 20, f"{sent} bytes were taken"
        assert not answer or answer.split()[1].startswith(b"4"), answer[:80]
    for body in (b"", b"[]", b"null", b"{\"procedure\":\"scan\"}", b"{\"procedure\":\"dance\"}", b"[" * 5000, b"{\"procedure\":\"check\",\"x\":1}", b"{\"procedure\":\"calibrate\",\"target\":\"camera\",\"recording\":\"scan\",\"lense\":\"four\"}", b"\xff\xfe"):
        refused(f"order {body[:30]}", s.ask("POST", "/api/v1/jobs", body)[0])
    for method in ("DELETE", "PUT", "PATCH", "TRACE", "OPTIONS"):
        refused(f"{method} of the bar", s.ask(method, "/api/v1/bar", b"")[0])


def lease(s, cookie, found):
    """Only the tab with the lease can order anything. motion.py tests the motions of a robot."""
    other = {"tab": "other"}
    s.json("POST", "/lease")
    refused("an order without the lease", s.ask("POST", "/api/v1/jobs", {"procedure": "check"}, **other)[0])
    refused("the lease while another has it", s.ask("POST", "/api/v1/lease", {}, **other)[0])
    refused("the same tab's name in another session", s.ask("POST", "/api/v1/jobs", {"procedure": "check"}, token=False, Cookie=cookie)[0])
    refused("a tab without a name", s.ask("POST", "/api/v1/lease", {"firmly": True}, tab=None)[0])
    # This station has no robot: nothing can be armed, no motion waits, and none can be confirmed.
    refused("arming where there is no robot", s.ask("POST", "/api/v1/robot", {"armed": True})[0])
    pose = {"job": found["id"], "hash": found["outcome"]["poses"]["hash"]}
    refused("motion without the lease", s.ask("POST", "/api/v1/motion/press", pose, **other)[0])
    refused("motion that nobody asks for", s.ask("POST", "/api/v1/motion/press", pose)[0])
    refused("motion that nobody confirmed", s.ask("POST", "/api/v1/motion/go", {"grant": "0" * 32, "what": pose})[0])
    # Every tab may stop a job; this one is refused because the job does not run.
    refused("stopping what does not run", s.ask("POST", f"/api/v1/jobs/{found['id']}/stop", {}, **other)[0])


def grown(data):
    """Rows received with a message of the running scan's map, and all rows of the scan."""
    words = struct.unpack_from("<6I", data)
    return words[4] + words[5], words[3]


def viewers(s):
    """Fifty viewers, one of which reads nothing, neither stop a scan nor use much memory."""
    # A scan has run before, so that this peak already contains the memory of a scan.
    before, sockets = s.peak_mb(), []
    for _ in range(50):
        status, c = s.socket()
        assert status == 101, status
        sockets.append(c)
    first = [frame(c) for c in sockets[1:]]
    assert all(json.loads(data)["event"] == "state" for _, data in first)
    begun = time.time()
    s.json("POST", "/lease")
    job = s.json("POST", "/jobs", {"procedure": "scan", "recording": "scan"})
    seen, rows, total = set(), 0, None
    while True:
        kind, data = frame(sockets[1])
        if kind == 2:
            assert data[:4] == b"GROW"
            if rows == 0:
                # A viewer is killed while the scan runs: its connection is reset without a WebSocket close message.
                sockets[2].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                sockets[2].close()
            rows, total = grown(data)
        elif kind == 1:
            event = json.loads(data)
            seen.add(event["event"])
            if event["event"] == "job" and event["data"]["id"] == job["id"] and event["data"]["state"] == "done":
                break
    took, more = time.time() - begun, s.peak_mb() - before
    print(f"50 viewers, one of which reads nothing: scan in {took:.1f} s, peak {more:.0f} MB above that of a scan alone")
    assert more <= 64, f"{more} MB"
    # The bar and the last rows may arrive after the end of a short scan.
    while "bar" not in seen or rows != total:
        kind, data = frame(sockets[1])
        seen |= {json.loads(data)["event"]} if kind == 1 else set()
        rows, total = grown(data) if kind == 2 else (rows, total)
    assert total > 20, total
    for c in sockets:
        c.close()


def begun(s, job, least):
    """Waits until at least `least` units of a job are done, or until the job has ended."""
    now = lambda: s.json("GET", f"/jobs/{job}")
    until(f"{least} of {job}", lambda: (lambda j: j["done"] >= least or j["state"] not in ("queued", "running"))(now()))


def killed_in(order, least, *behind):
    """Kills a server in the middle of a job. Returns that server, its next start, the job, and the jobs queued behind it.
    Tries again if the job ended before the server was killed."""
    for _ in range(10):
        s = Server(program, folder, "--recordings", folder)
        s.json("POST", "/lease")
        job, *others = [s.json("POST", "/jobs", o)["id"] for o in (order, *behind)]
        begun(s, job, least)
        s.kill()
        again = Server(program, folder, "--recordings", folder)
        if again.json("GET", f"/jobs/{job}")["state"] != "done":
            return s, again, job, *others
        assert again.end() == 0
    raise AssertionError(f"{order} always ends before the server can be killed")


def killed():
    """A server killed in a scan: the job can be resumed and finishes; the token of the earlier start is refused."""
    s, again, job, second = killed_in({"procedure": "scan", "recording": "scan"}, 5, {"procedure": "check"})
    refused("the token of a former start", again.ask("GET", "/api/v1/bar", token=s.token)[0])
    cut = again.json("GET", f"/jobs/{job}")
    assert cut["state"] == "cut_off" and cut["outcome"] is None and cut["resumable"], cut
    assert again.json("GET", f"/jobs/{second}")["state"] == "cut_off"
    refused("a scan that is half done", again.ask("GET", f"/api/v1/scans/{job}/map")[0])
    assert any("cut off" in a for a in again.json("GET", "/bar")["alarms"])
    # A second server for the same station refuses to start, and says why.
    try:
        Server(program, folder, "--recordings", folder)
        raise SystemExit("two screens for one station")
    except AssertionError as e:
        assert "another screen" in str(e), e
    again.json("POST", "/lease")
    again.json("POST", f"/jobs/{job}/resume")
    whole = again.ended(job)
    assert whole["state"] == "done", whole
    again.json("DELETE", f"/jobs/{second}")
    refused("a job that was taken away", again.ask("GET", f"/api/v1/jobs/{second}")[0])
    # The server is ended while a job runs: the job is stopped and can be resumed.
    third = again.json("POST", "/jobs", {"procedure": "scan", "recording": longer(folder, 100)})["id"]
    begun(again, third, 5)
    assert again.end() == 0
    with open(os.path.join(folder, "station", "jobs", third, "job.json")) as f:
        assert json.load(f)["state"] == "stopped"
    return whole


def killed_in_a_calibration():
    """A killed calibration stores nothing in the station. It can be resumed, and only a person accepts its result."""
    camera = os.path.join(folder, "station", "calibration", "camera.json")
    with open(camera, "rb") as f:
        before = f.read()
    _, again, job = killed_in({"procedure": "calibrate", "target": "camera", "recording": "intrinsics"}, 2)
    cut = again.json("GET", f"/jobs/{job}")
    assert cut["state"] == "cut_off" and cut["outcome"] is None and cut["resumable"], cut
    again.json("POST", "/lease")
    refused("accepting what was cut off", again.ask("POST", f"/api/v1/jobs/{job}/accept", {})[0])
    again.json("POST", f"/jobs/{job}/resume")
    whole = again.ended(job)
    assert whole["state"] == "done" and whole["outcome"]["verdict"] and not whole["outcome"]["accepted"], whole
    with open(camera, "rb") as f:
        assert f.read() == before, "the station has a calibration that nobody accepted"
    assert again.end() == 0


def starts():
    """Start with no station in the folder, a used port, a broken station, or missing links: each is reported with a remedy."""
    run = lambda station, *more: subprocess.run([program, "station", "serve", "--station", station, "--port", "0", *more], capture_output=True, text=True, timeout=PATIENCE)
    empty = os.path.join(folder, "empty")
    os.makedirs(empty)
    for station in (os.path.join(folder, "nothing"), empty, os.path.join(folder, "scan")):
        bad = run(station)
        assert bad.returncode != 0 and "station.toml" in bad.stderr and "station new" in bad.stderr, bad.stderr
    foreign = os.path.join(folder, "foreign", "station")
    shutil.copytree(os.path.join(folder, "station"), foreign, ignore=shutil.ignore_patterns("jobs"))
    with open(os.path.join(foreign, "station.toml"), "w") as f:
        f.write("[tool.poetry]\nname = 'another program'\n")
    s = Server(program, os.path.join(folder, "foreign"))
    assert any("station.toml" in a for a in s.json("GET", "/bar")["alarms"]), s.json("GET", "/bar")
    assert "station.toml" in s.json("GET", "/station")["problem"]["what"]
    assert s.end() == 0
    # Another program uses the port: the server names that program and takes the next free port.
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        s = Server(program, folder, "--port", str(port))
        assert port < int(s.host.rsplit(":", 1)[1]) <= port + 20, s.host
        # The message and the address arrive through two pipes, in any order.
        wanted = (f"port {port} is taken by python", f"(process {os.getpid()})")
        until("who has the port", lambda: all(w in "".join(s.said) for w in wanted))
        assert s.end() == 0
    # Without camera and robot the screen starts all the same, and shows two alarms.
    s = Server(program, folder, "--camera", "cell://127.0.0.1:1", "--robot", "bcap://127.0.0.1:1")
    until("both alarms", lambda: len(s.json("GET", "/bar")["alarms"]) >= 2)
    bar = s.json("GET", "/bar")
    assert bar["robot"] == "no_link" and bar["camera"] and bar["laser"] is None, bar
    assert s.ask("GET", "/api/v1/camera/newest")[0] == 204 and s.ask("GET", "/")[0] == 200
    assert s.end() == 0


def main():
    starts()
    token = os.path.join(folder, "figures.token")
    with open(token, "w") as f:
        f.write("too short\n")
    served = [program, "station", "serve", "--station", os.path.join(folder, "station"), "--metrics-token-file", token]
    bad = subprocess.run(served, capture_output=True, text=True, timeout=PATIENCE)
    assert bad.returncode == 2 and "20 printable" in bad.stderr, bad.stderr
    with open(token, "w") as f:
        f.write(FIGURES + "\n")
    s = Server(program, folder, "--recordings", folder, "--metrics-token-file", token)
    cookie = who_gets_in(s)
    scanned = s.job({"procedure": "scan", "recording": "scan"})
    assert scanned["state"] == "done", scanned
    found = s.job({"procedure": "find", "scans": [scanned["id"]], "recipe": "led"})
    assert found["state"] == "done" and found["outcome"]["passed"], found
    lease(s, cookie, found)
    names(s, scanned["id"])
    figures(s)
    bodies(s)
    viewers(s)
    assert s.token not in "".join(s.said), "the token is in what the program said"
    assert s.end() == 0
    whole = killed()
    same = ("points", "median_sigma_mm", "peaks")
    killed_in_a_calibration()
    assert {k: whole["outcome"][k] for k in same} == {k: scanned["outcome"][k] for k in same}, "a resumed scan is another one"


main()
