"""In: the program, a simulated station, Eclipse Mosquitto as the broker, Eclipse Paho as the subscriber. Out: failure if what a
subscriber reads is not what the screen's own interface says, if a broker that is missing, refuses or goes away costs the
server anything but its messages, or if a message from outside changes anything.
Frame and unit: s."""

import json
import os
import subprocess
import sys
import threading
import time

from mosquitto import LOGIN, Folder, Mosquitto, alarmed, connected, free_port, installed
from server import Server
from waits import until

program, folder = sys.argv[1:3]
TOPIC = "plant/cell3"
FILES = None


def file(name, text=None):
    return FILES.file(name, text)


class Subscriber:
    """Keeps every message below the station's topic."""

    def __init__(self, mqtt, port):
        self.messages, self.lock = [], threading.Lock()
        self.client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        self.client.username_pw_set(*LOGIN)
        self.client.on_connect = lambda client, *_: client.subscribe(TOPIC + "/#", qos=1)
        self.client.on_message = self.keep
        self.client.connect("127.0.0.1", port)
        self.client.loop_start()

    def keep(self, _client, _data, message):
        with self.lock:
            self.messages.append((message.topic.removeprefix(TOPIC + "/"), message.payload.decode(), message.retain))

    def all(self, topic):
        with self.lock:
            return [text for t, text, _ in self.messages if t == topic]

    def last(self, topic):
        return (self.all(topic) or [None])[-1]

    def end(self):
        self.client.loop_stop()
        self.client.disconnect()


def published(mqtt, port):
    s = Server(program, folder, "--mqtt", f"mqtt://127.0.0.1:{port}", "--mqtt-topic", TOPIC, "--mqtt-login", file("login"))
    # The server starts without its broker, and says so.
    until("that the broker is missing", lambda: connected(s) == "0" and alarmed(s))
    broker = Mosquitto(FILES, port)
    until("the broker", lambda: connected(s) == "1" and not alarmed(s))
    reader = Subscriber(mqtt, port)
    until("online", lambda: reader.last("state") == "online")
    status = json.loads(until("the bar", lambda: reader.last("status")))
    assert status["station"] == s.json("GET", "/bar")["station"], status

    job = s.job({"procedure": "check"})
    result = json.loads(until("the result", lambda: reader.last("result/check")))
    assert result == job and result["outcome"]["lines"], (result, job)
    states = [json.loads(text)["state"] for text in reader.all("job/check")]
    assert states[-1] == "done" and len(states) == len(set(states)) >= 2, states
    # A long result, with the part's outline and its pose in all notations, arrives whole.
    scan = s.job({"procedure": "scan", "recording": "scan"})
    found = s.job({"procedure": "find", "scans": [scan["id"]], "recipe": "led"})
    text = until("the part", lambda: reader.last("result/find"))
    assert json.loads(text) == found, (text, found)
    print(f"a result of {len(text)} bytes")
    (link,) = s.json("GET", "/settings")["connections"]
    assert link["door"] == "mqtt" and link["problem"] is None and link["lost"] == 0 and link["sent"] >= len(states), link
    # Who subscribes later gets what is kept, and no old changes.
    late = Subscriber(mqtt, port)
    until("what is kept", lambda: late.last("state") == "online" and late.last("result/check") and late.last("status"))
    assert late.all("job/check") == [], late.messages
    assert json.loads(late.last("result/check"))["id"] == job["id"]
    late.end()

    # Messages to the station's own topics order nothing.
    before = s.json("GET", "/jobs")
    for topic in ("", "/job", "/job/check", "/command", "/state", "/result/check"):
        for text in ('{"procedure": "check"}', "x" * 100_000, ""):
            reader.client.publish(TOPIC + topic, text, qos=1).wait_for_publish(10)
    time.sleep(1)
    assert s.json("GET", "/jobs") == before

    # The broker goes away and comes back; jobs go on meanwhile.
    reader.end()
    broker.end()
    until("that the broker is gone", lambda: connected(s) == "0" and alarmed(s))
    # More messages than places for those that wait: one when a job is ordered, one when it is stopped.
    s.json("POST", "/lease")
    first = s.json("POST", "/jobs", {"procedure": "check"})["id"]
    for _ in range(40):
        name = s.json("POST", "/jobs", {"procedure": "check"})["id"]
        s.json("POST", f"/jobs/{name}/stop")
    assert s.ended(first)["state"] == "done"
    (link,) = s.json("GET", "/settings")["connections"]
    assert link["lost"] > 0, link
    broker = Mosquitto(FILES, port)
    until("the broker again", lambda: connected(s) == "1")
    reader = Subscriber(mqtt, port)
    until("online again", lambda: reader.last("state") == "online" and reader.last("status"))
    # A killed program is reported by the broker itself.
    s.process.kill()
    s.process.wait()
    until("offline", lambda: reader.last("state") == "offline")
    reader.end()
    broker.end()
    print(f"{len(reader.messages)} messages after the broker came back")


def refused_login(port):
    broker = Mosquitto(FILES, port)
    s = Server(program, folder, "--mqtt", f"mqtt://127.0.0.1:{port}", "--mqtt-login", file("wrong"))
    why = until("why it is not connected", lambda: connected(s) == "0" and [a for a in alarmed(s) if "does not answer" in a])
    assert LOGIN[1] not in why[0] and "a wrong one" not in why[0], why
    assert s.job({"procedure": "check"})["state"] == "done"
    s.process.terminate()
    assert s.process.wait(30) == 0
    broker.end()


def encrypted(mqtt, port):
    broker = Mosquitto(FILES, port, tls=True)
    more = ("--mqtt", f"mqtts://localhost:{port}", "--mqtt-topic", TOPIC, "--mqtt-login", file("login"))
    s = Server(program, folder, *more, "--mqtt-ca", file("ca.pem"))
    until("the encrypted broker", lambda: connected(s) == "1")
    s.process.terminate()
    s.process.wait(30)
    # An authority that nobody knows is not trusted.
    s = Server(program, folder, *more)
    until("that the certificate is refused", lambda: connected(s) == "0" and [a for a in alarmed(s) if "ertificate" in a])
    s.process.terminate()
    s.process.wait(30)
    broker.end()


def certificates():
    def openssl(*words):
        subprocess.run(["openssl", *words], check=True, capture_output=True)

    openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=plant", "-keyout", file("ca.key"), "-out", file("ca.pem"))
    openssl("req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-keyout", file("broker.key"), "-out", file("broker.csr"))
    names = file("names", "subjectAltName=DNS:localhost,IP:127.0.0.1\n")
    openssl("x509", "-req", "-in", file("broker.csr"), "-CA", file("ca.pem"), "-CAkey", file("ca.key"), "-CAcreateserial", "-days", "2", "-extfile", names, "-out", file("broker.pem"))
    for name in ("broker.key", "broker.pem"):
        os.chmod(file(name), 0o644)


def main():
    global FILES
    if not installed():
        print("mosquitto is not installed (tools/cameras.sh)")
        sys.exit(77)
    try:
        import paho.mqtt.client as mqtt
    except ImportError as e:
        print(f"{e} (make python)")
        sys.exit(77)
    FILES = Folder(folder)
    certificates()
    for words, part in ((["--mqtt", "http://x"], "not the address"), (["--mqtt", "mqtt://10.0.0.7", "--mqtt-login", file("login")], "in clear")):
        run = subprocess.run([program, "station", "serve", "--station", file("station"), *words], capture_output=True, text=True, timeout=60)
        assert run.returncode != 0 and part in run.stderr, (words, run)
    published(mqtt, free_port())
    refused_login(free_port())
    encrypted(mqtt, free_port())


main()
