"""In: the program under test, a folder with a simulated station. Out: the screen as a server process, and raw requests to it.
Frame and unit: seconds."""

import atexit
import base64
import http.client
import json
import os
import socket
import struct
import subprocess
import threading

from waits import PATIENCE, until


class Server:
    """`sheetlight station serve` on any free port."""

    def __init__(self, program, folder, *more, stdin=None, env=None):
        """With --simulate the program creates the station in `folder`; otherwise `folder` contains one."""
        station = folder if "--simulate" in more else os.path.join(folder, "station")
        self.station = station
        command = [program, "--json", "station", "serve", "--station", station, *(() if "--port" in more else ("--port", "0")), *more]
        self.process = subprocess.Popen(command, stdin=stdin, env={**os.environ, **(env or {})}, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        # A test that fails leaves no server behind.
        atexit.register(self.process.kill)
        self.said = []
        reader = threading.Thread(target=lambda: self.said.extend(line.decode() for line in self.process.stderr), daemon=True)
        reader.start()
        text = ""
        while text.count("{") != text.count("}") or not text:
            line = self.process.stdout.readline().decode()
            if not line:
                # The last messages of the server may not have been read yet.
                self.process.wait(PATIENCE)
                reader.join(PATIENCE)
            assert line, f"the server ended: {''.join(self.said)}"
            text += line
        assert "url" in json.loads(text), text
        self.url = json.loads(text)["url"]
        self.host = self.url.split("/")[2]
        self.token = self.url.split("token=")[1]

    def ask(self, method, path, body=None, host=None, token=True, tab="tests", **headers):
        """Sends a request without any additional headers. Returns status, headers, body."""
        name, port = self.host.rsplit(":", 1)
        c = http.client.HTTPConnection(name, int(port), timeout=PATIENCE)
        head = {"Host": host or self.host, **{k.replace("_", "-"): v for k, v in headers.items()}}
        if token:
            head["Authorization"] = f"Bearer {self.token if token is True else token}"
        if tab:
            head["X-Sheetlight-Tab"] = tab
        if body is not None and not isinstance(body, bytes):
            body = json.dumps(body).encode()
        c.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        if body is not None:
            head.setdefault("Content-Length", str(len(body)))
        for k, v in head.items():
            c.putheader(k, v)
        c.endheaders(body)
        answer = c.getresponse()
        data = answer.read()
        c.close()
        return answer.status, dict((k.lower(), v) for k, v in answer.getheaders()), data

    def json(self, method, path, body=None, **more):
        status, _, data = self.ask(method, "/api/v1" + path, body, **more)
        assert status < 300, f"{method} {path}: {status} {data[:600]}"
        return json.loads(data)

    def job(self, order, seconds=PATIENCE):
        """Orders a job and waits for its end."""
        self.json("POST", "/lease")
        job = self.json("POST", "/jobs", order)
        return self.ended(job["id"], seconds)

    def ended(self, name, seconds=PATIENCE):
        def over():
            job = self.json("GET", f"/jobs/{name}")
            return job if job["state"] not in ("queued", "running") else None

        return until(f"the end of {name}", over, seconds)

    def socket(self, token=True, tab=None, **headers):
        """Opens a WebSocket. Returns the status of the handshake and the socket."""
        name, port = self.host.rsplit(":", 1)
        s = socket.create_connection((name, int(port)), timeout=PATIENCE)
        head = {"Host": self.host, "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(), **{k.replace("_", "-"): v for k, v in headers.items()}}
        if token:
            head["Authorization"] = f"Bearer {self.token if token is True else token}"
        s.sendall((f"GET /api/v1/events{f'?tab={tab}' if tab else ''} HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in head.items()) + "\r\n").encode())
        said = b""
        while b"\r\n\r\n" not in said:
            more = s.recv(1)
            if not more:
                break
            said += more
        return int(said.split(b" ")[1]), s

    def peak_mb(self):
        with open(f"/proc/{self.process.pid}/status") as f:
            return next(int(line.split()[1]) for line in f if line.startswith("VmHWM")) / 1024

    def kill(self):
        self.process.kill()
        self.process.wait(PATIENCE)

    def end(self):
        """Ends the server by SIGTERM. Returns its exit code."""
        self.process.terminate()
        return self.process.wait(PATIENCE)


def say(s, text):
    """Sends a text of less than 126 bytes over a WebSocket, masked as clients must."""
    mask, data = os.urandom(4), text.encode()
    s.sendall(bytes([0x81, 0x80 | len(data)]) + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))


def events(folder):
    """The events in the simulated cell's log so far."""
    path = os.path.join(folder, "cell.jsonl")
    if not os.path.exists(path):
        return []
    with open(path) as f:
        return [json.loads(line) for line in f if line.endswith("\n")]


def frame(s):
    """Reads the next message of a WebSocket. Returns its opcode and its bytes."""
    def exactly(n):
        out = b""
        while len(out) < n:
            more = s.recv(n - len(out))
            assert more, "the socket was closed"
            out += more
        return out
    kind, length = exactly(2)
    if length == 126:
        length = struct.unpack(">H", exactly(2))[0]
    elif length == 127:
        length = struct.unpack(">Q", exactly(8))[0]
    return kind & 15, exactly(length)
