"""In: the program, a station. Out: failure if the screen, served with a password and TLS, admits somebody without the
password, answers without TLS, or starts with invalid files.
Frame and unit: s."""

import http.client
import json
import os
import pty
import shutil
import ssl
import subprocess
import sys
import threading
import time

from server import Server
from waits import PATIENCE

program, folder = sys.argv[1:3]
PASSWORD = "correct horse battery"


def file(name):
    return os.path.join(folder, name)


def typed(out, *lines):
    """Types lines at the program's password prompt. Returns what the terminal shows, and the exit code."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.execv(program, [program, "station", "password", "--out", out])
    shown, asked = b"", 0
    try:
        while more := os.read(terminal, 4096):
            shown += more
            # The program prompts for each line, and does not show what is typed.
            if asked < len(lines) and shown.count(b": ") > asked:
                time.sleep(0.3)
                os.write(terminal, lines[asked].encode() + b"\n")
                asked += 1
    except OSError:
        # The terminal closes when the program ends.
        pass
    return shown.decode(), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def unseen():
    shown, code = typed(file("typed"), PASSWORD, PASSWORD)
    assert code == 0 and "once more" in shown and "horse" not in shown, (code, shown)
    with open(file("typed")) as f:
        assert f.read().startswith("$argon2id$")
    shown, code = typed(file("slip"), PASSWORD, PASSWORD + "x")
    assert code != 0 and "not the same" in shown and "horse" not in shown and not os.path.exists(file("slip")), (code, shown)


def main():
    unseen()
    made = subprocess.run([program, "station", "password", "--out", file("pw")], input=PASSWORD + "\n", capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    with open(file("pw")) as f:
        text = f.read()
    assert text.startswith("$argon2id$") and "horse" not in text + made.stdout + made.stderr
    short = subprocess.run([program, "station", "password", "--out", file("short")], input="short\n", capture_output=True, text=True)
    assert short.returncode != 0 and not os.path.exists(file("short")), short.stderr
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=cell3.plant", "-addext", "subjectAltName=DNS:cell3.plant,IP:127.0.0.1", "-keyout", file("key.pem"), "-out", file("cert.pem")], check=True, capture_output=True)
    secured = ("--recordings", folder, "--listen", "0.0.0.0", "--name", "cell3.plant", "--password-file", file("pw"))
    # Without a password file, with a password instead of its hash, or with an invalid key, it does not start and says why.
    with open(file("plain"), "w") as f:
        f.write(PASSWORD + "\n")
    for more, why in (
        (("--listen", "0.0.0.0"), "password"),
        ((*secured[:-1], file("plain"), "--tls-cert", file("cert.pem"), "--tls-key", file("key.pem")), "no Argon2 hash"),
        ((*secured, "--tls-cert", file("cert.pem"), "--tls-key", file("pw")), "cannot be used for TLS"),
    ):
        bad = subprocess.run([program, "station", "serve", "--station", file("station"), "--port", "0", *more], capture_output=True, text=True, timeout=PATIENCE)
        assert bad.returncode != 0 and why in bad.stderr, (more, bad.stderr)
    s = Server(program, folder, *secured, "--tls-cert", file("cert.pem"), "--tls-key", file("key.pem"))
    assert s.url.startswith("https://"), s.url
    port = int(s.host.rsplit(":", 1)[1])
    context = ssl.create_default_context(cafile=file("cert.pem"))

    def ask(method, path, body=None, host=None, source="127.0.0.1", to="127.0.0.1", **headers):
        c = http.client.HTTPSConnection(to, port, timeout=PATIENCE, context=context, source_address=(source, 0))
        c.request(method, path, None if body is None else json.dumps(body), {"Host": host or f"{to}:{port}", "X-Sheetlight-Tab": "tests", **headers})
        answer = c.getresponse()
        data = answer.read()
        c.close()
        return answer.status, dict((k.lower(), v) for k, v in answer.getheaders()), data

    assert ask("GET", "/")[0] == 200
    assert ask("GET", "/api/v1/bar")[0] == 401
    for knock in ({"password": ""}, {"password": PASSWORD + " "}, {"password": text.strip()}, {"token": "0" * 32}):
        begun = time.time()
        assert ask("POST", "/api/v1/session", knock)[0] == 401, knock
        # A wrong password is answered only after at least 0.5 s.
        assert "token" in knock or time.time() - begun > 0.5
    # Another machine tries wrong passwords in ten threads. It is told to wait, while the right password from this machine is
    # accepted without delay.
    answers, over = [], threading.Event()

    def guesses():
        while not over.is_set():
            status, head, _ = ask("POST", "/api/v1/session", {"password": "wrong horse battery"}, source="127.0.0.2")
            answers.append((status, head.get("retry-after")))

    guessing = [threading.Thread(target=guesses, daemon=True) for _ in range(10)]
    for one in guessing:
        one.start()
    time.sleep(3)
    begun = time.time()
    status, head, _ = ask("POST", "/api/v1/session", {"password": PASSWORD})
    took = time.time() - begun
    over.set()
    for one in guessing:
        one.join(PATIENCE)
    assert status == 200, status
    print(f"{len(answers)} wrong passwords from another machine, {sum(s == 429 for s, _ in answers)} of them refused untried; the right one took {took:.2f} s")
    assert all(s in (401, 429) and (s == 401 or int(after) >= 1) for s, after in answers), answers
    assert any(s == 429 for s, _ in answers) and sum(s == 401 for s, _ in answers) < 30, answers
    # Queued behind the wrong passwords, the right one would take more than two seconds.
    assert took < 2, took
    cookie = head["set-cookie"]
    assert all(word in cookie for word in ("Secure", "HttpOnly", "SameSite=Strict")), cookie
    cookie = cookie.split(";")[0]
    assert ask("GET", "/api/v1/bar", Cookie=cookie)[0] == 200
    assert ask("GET", "/api/v1/bar", host=f"cell3.plant:{port}", Cookie=cookie)[0] == 200
    # The Host may be the address of the connection, or the name without a port, as when a router forwards port 443. Any other
    # Host is refused.
    context.check_hostname = False
    assert ask("GET", "/api/v1/bar", to="127.0.0.3", Cookie=cookie)[0] == 200
    assert ask("GET", "/api/v1/bar", host="cell3.plant", Cookie=cookie)[0] == 200
    assert ask("GET", "/api/v1/bar", host="CELL3.plant.:443", Cookie=cookie)[0] == 200
    for host in (f"cell4.plant:{port}", f"0.0.0.0:{port}", f"10.1.2.3:{port}", f"[fd00::1]:{port}", "127.0.0.1", f"cell3.plant:{port + 1}", f"me@cell3.plant:{port}"):
        assert 400 <= ask("GET", "/api/v1/bar", host=host, Cookie=cookie)[0] < 500, host
    assert s.url.startswith(f"https://cell3.plant:{port}/#token="), s.url
    assert 400 <= ask("POST", "/api/v1/lease", {}, Cookie=cookie, Origin=f"http://cell3.plant:{port}")[0] < 500, "a page without TLS"
    assert ask("POST", "/api/v1/lease", {}, Cookie=cookie, Origin=f"https://cell3.plant:{port}")[0] == 200
    # Plain HTTP on the same port is not answered.
    plain = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    try:
        plain.request("GET", "/", headers={"Host": f"127.0.0.1:{port}"})
        raise SystemExit(f"plain HTTP was answered: {plain.getresponse().status}")
    except (http.client.HTTPException, OSError):
        pass
    said = "".join(s.said)
    assert PASSWORD not in said and s.token not in said
    assert s.end() == 0


if not shutil.which("openssl"):
    print("no openssl here")
    sys.exit(77)
main()
