"""In: the program, a folder with the station of a simulated cell, the addresses of its robot and camera, the size in kB that no
file may exceed (0: any). Out: the process of the server, then what the registers of a PLC say of its job that something else
interferes with; failure if these are not the words of the job's record.
Frame and unit: s."""

import json
import os
import sys
import threading
import time

import registers
from hands import Operator
from registers import CUT_OFF, DONE, FAILED, INSERT, STOPPED, Plc, plain
from server import Server
from waits import until

program, folder, robot, camera, most_kb = sys.argv[1:6]
OVER = (DONE, FAILED, STOPPED, CUT_OFF)
PATIENCE = 240


def served(by):
    s = Server(by, folder, "--recordings", folder, "--robot", robot, "--camera", camera, "--allow-motion", "--modbus", "0")
    (link,) = s.json("GET", "/settings")["connections"]
    return s, int(link["address"].rsplit(":", 1)[1])


def limited():
    """The program with files that grow to a size at most, as on a disk that is full."""
    if int(most_kb) == 0:
        return program
    path = os.path.join(folder, "limited.sh")
    with open(path, "w") as f:
        f.write(f"#!/bin/bash\ntrap '' XFSZ\nulimit -f {most_kb}\nexec '{program}' \"$@\"\n")
    os.chmod(path, 0o755)
    return path


def followed(s, plc):
    """The job's registers when it has ended; those of the next start, if the program ended before."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if s.process.poll() is not None:
            break
        try:
            job = plc.job()
        except Exception:  # noqa: BLE001: pymodbus has several for a connection that is gone
            s.process.wait(PATIENCE)
            break
        if job.state in OVER:
            return s, job
        time.sleep(0.02)
    assert s.process.poll() is not None, f"the job does not end: {plc.job()}\n{''.join(s.said)}"
    s, port = served(program)
    return s, Plc(port).job()


def main():
    s, port = served(limited())
    print(s.process.pid, flush=True)
    plc, op = Plc(port), Operator(s)
    op.arm()
    until("the armed robot", lambda: plc.job().attended)
    plc.recipe("osc", 28)
    error, said, _ = plc.ask(INSERT)
    assert error == 0, said
    number = plc.job().number
    over = threading.Event()
    person = threading.Thread(target=op.confirms, args=(over,), daemon=True)
    person.start()
    try:
        s, job = followed(s, plc)
    finally:
        over.set()
    assert job.number == number and job.state in OVER, job
    stored = s.json("GET", "/jobs")[0]
    if job.state == CUT_OFF:
        assert stored["state"] == "cut_off" and "while the job ran" in job.words, (job, stored)
    elif job.state != DONE:
        assert job.words == plain(stored["problem"]["what"]) != "", (job, stored)
    print(json.dumps({"state": job.state, "error": job.error, "words": job.words, "step": job.step, "found": job.found}), flush=True)
    s.end()


if not registers.present():
    print("pymodbus is not here (make python)")
    sys.exit(77)
main()
