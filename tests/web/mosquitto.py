"""In: a folder. Out: Eclipse Mosquitto as a broker that asks for a login, in clear or with TLS.
Frame and unit: none."""

import os
import shutil
import socket
import subprocess

LOGIN = ("station", "a password")


def installed():
    return bool(shutil.which("mosquitto") or os.path.exists("/usr/sbin/mosquitto"))


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Folder:
    """The files of brokers and of their clients: `login` for the program, `wrong` with another password."""

    def __init__(self, path):
        self.path = path
        self.file("login", "\n".join(LOGIN) + "\n")
        self.file("wrong", f"{LOGIN[0]}\na wrong one\n")
        tool = shutil.which("mosquitto_passwd") or "/usr/bin/mosquitto_passwd"
        subprocess.run([tool, "-b", "-c", self.file("passwords"), *LOGIN], check=True, capture_output=True)
        # The broker drops root's rights before it reads them.
        for readable in (self.file("passwords"), path):
            os.chmod(readable, 0o755)

    def file(self, name, text=None):
        path = os.path.join(self.path, name)
        if text is not None:
            with open(path, "w") as f:
                f.write(text)
        return path


class Mosquitto:
    """A broker that wants the login, in clear or with the certificate `broker.pem`."""

    def __init__(self, folder, port, tls=False):
        file = folder.file
        lines = [f"listener {port} 127.0.0.1", "allow_anonymous false", f"password_file {file('passwords')}"]
        if tls:
            lines += [f"certfile {file('broker.pem')}", f"keyfile {file('broker.key')}"]
        self.log = open(file(f"mosquitto-{port}.log"), "a")
        command = [shutil.which("mosquitto") or "/usr/sbin/mosquitto", "-c", file(f"mosquitto-{port}.conf", "\n".join(lines) + "\n")]
        self.process = subprocess.Popen(command, stdout=self.log, stderr=self.log)

    def end(self):
        self.process.terminate()
        self.process.wait()


def connected(s):
    """What the program's figures say of its broker: "0", "1", or None if none was named."""
    figures = s.ask("GET", "/api/v1/metrics")[2].decode()
    return next((line.split()[-1] for line in figures.splitlines() if line.startswith("sheetlight_mqtt_connected")), None)


def alarmed(s):
    return [a for a in s.json("GET", "/bar")["alarms"] if "mqtt" in a]
