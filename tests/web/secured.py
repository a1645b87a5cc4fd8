"""In: the program, a station. Out: failure where the screen, served with a password and TLS, lets in who does not know it, speaks without
TLS, or starts with files that are none.
Frame and unit: s."""

import http.client
import json
import os
import shutil
import ssl
import subprocess
import sys
import time

from server import Server
from waits import PATIENCE

program, folder = sys.argv[1:3]
PASSWORD = "correct horse battery"


def file(name):
    return os.path.join(folder, name)


def main():
    made = subprocess.run([program, "station", "password", "--out", file("pw")], input=PASSWORD + "\n", capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    with open(file("pw")) as f:
        text = f.read()
    assert text.startswith("$argon2id$") and "horse" not in text + made.stdout + made.stderr
    short = subprocess.run([program, "station", "password", "--out", file("short")], input="short\n", capture_output=True, text=True)
    assert short.returncode != 0 and not os.path.exists(file("short")), short.stderr
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=cell3.plant", "-addext", "subjectAltName=DNS:cell3.plant,IP:127.0.0.1", "-keyout", file("key.pem"), "-out", file("cert.pem")], check=True, capture_output=True)
    secured = ("--recordings", folder, "--listen", "0.0.0.0", "--name", "cell3.plant", "--password-file", file("pw"))
    # Without TLS, with the password itself as its hash, with a key that is none: it does not start, and says why.
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

    def ask(method, path, body=None, host=None, **headers):
        c = http.client.HTTPSConnection("127.0.0.1", port, timeout=PATIENCE, context=context)
        c.request(method, path, None if body is None else json.dumps(body), {"Host": host or f"127.0.0.1:{port}", "X-Sheetlight-Tab": "tests", **headers})
        answer = c.getresponse()
        data = answer.read()
        c.close()
        return answer.status, dict((k.lower(), v) for k, v in answer.getheaders()), data

    assert ask("GET", "/")[0] == 200
    assert ask("GET", "/api/v1/bar")[0] == 401
    for knock in ({"password": ""}, {"password": PASSWORD + " "}, {"password": text.strip()}, {"token": "0" * 32}):
        begun = time.time()
        assert ask("POST", "/api/v1/session", knock)[0] == 401, knock
        # Passwords are tried slowly.
        assert "token" in knock or time.time() - begun > 0.5
    status, head, _ = ask("POST", "/api/v1/session", {"password": PASSWORD})
    assert status == 200, status
    cookie = head["set-cookie"]
    assert all(word in cookie for word in ("Secure", "HttpOnly", "SameSite=Strict")), cookie
    cookie = cookie.split(";")[0]
    assert ask("GET", "/api/v1/bar", Cookie=cookie)[0] == 200
    assert ask("GET", "/api/v1/bar", host=f"cell3.plant:{port}", Cookie=cookie)[0] == 200
    assert 400 <= ask("GET", "/api/v1/bar", host=f"cell4.plant:{port}", Cookie=cookie)[0] < 500
    assert 400 <= ask("POST", "/api/v1/lease", {}, Cookie=cookie, Origin=f"http://cell3.plant:{port}")[0] < 500, "a page without TLS"
    assert ask("POST", "/api/v1/lease", {}, Cookie=cookie, Origin=f"https://cell3.plant:{port}")[0] == 200
    # Plain HTTP on the same port gets no answer.
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
