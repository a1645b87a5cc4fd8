"""Requests over Modbus TCP by pymodbus, which shares no code with the server: a PLC's scan of a simulated board."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import time

import numpy as np
import pytest
from conftest import ROOT, needs

SCAN, POSE, FIND, GIVE = 1, 2, 3, 4


class Plc:
    """The registers of docs/connections.md, as a PLC's program uses them."""

    def __init__(self, port, source="127.0.0.1"):
        needs("pymodbus")
        from pymodbus.client import ModbusTcpClient

        self.client = ModbusTcpClient("127.0.0.1", port=port, timeout=5, source_address=(source, 0))
        assert self.client.connect()
        self.number = self.read()[3]

    def numbers(self, values):
        return self.client.convert_to_registers([round(v) for v in values], self.client.DATATYPE.INT32)

    def read(self):
        answer = self.client.read_input_registers(0, count=121)
        assert not answer.isError(), answer
        return answer.registers

    def write(self, address, values):
        return self.client.write_registers(address, values)

    def ask(self, word, *more):
        """(error, words, all registers) of a request; the number and the word are written last."""
        self.number = self.number % 65535 + 1
        assert not self.write(0, [self.number, word, *more]).isError()
        for _ in range(6000):
            registers = self.read()
            if registers[2] == 0 and registers[3] == self.number:
                data = b"".join(r.to_bytes(2, "big") for r in registers[21:])
                return registers[4], data[: registers[20]].decode("ascii"), registers
            time.sleep(0.01)
        raise AssertionError(f"no answer to {word}")

    def pose(self, registers):
        numbers = self.client.convert_from_registers(registers[8:20], self.client.DATATYPE.INT32)
        return np.array(numbers) / [1000, 1000, 1000, 10000, 10000, 10000]

    def recipe(self, name):
        padded = name.encode().ljust(40, b"\0")
        assert not self.write(16, [int.from_bytes(padded[i : i + 2], "big") for i in range(0, 40, 2)]).isError()


def kuka(pose):
    """X Y Z in mm and A B C in degrees: turns about z, then y, then x, each about the axis as turned."""
    from scipy.spatial.transform import Rotation

    return [*pose[:3, 3], *Rotation.from_matrix(pose[:3, :3]).as_euler("ZYX", degrees=True)]


def axis(numbers):
    """The tool's z axis of a pose in that notation."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("ZYX", numbers[3:], degrees=True).as_matrix()[:, 2]


@pytest.fixture(scope="module")
def served(made, tmp_path_factory):
    """The port of a server whose camera shows the shots of the shared scan one after the other."""
    program = os.environ.get("SHEETLIGHT_PROGRAM")
    if program is None:
        pytest.skip("SHEETLIGHT_PROGRAM names no program")
    folder = tmp_path_factory.mktemp("modbus")
    # A camera without a clock: of four pictures the first three may have been exposed before the request.
    shown = folder / "shown"
    shutil.copytree(made.recording().folder, shown)
    meta = json.loads((shown / "meta.json").read_text())
    meta["frames"] = [frame for frame in meta["frames"] for _ in range(4)]
    (shown / "meta.json").write_text(json.dumps(meta))
    command = [program, "robot", "serve", "--protocol", "modbus", "--station", made.station.folder, "--camera"]
    command += [f"play:{shown}", "--recipes", ROOT / "data/recipes", "--notation", "kuka", "--out", folder / "out"]
    command += ["--listen", "127.0.0.1:0", "--on", "cpu"]
    with (folder / "said").open("w") as said:
        server = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=said, text=True)
        try:
            yield int(re.search(r"listens on 127\.0\.0\.1:(\d+)", server.stdout.readline()).group(1))
        finally:
            server.terminate()
            server.wait(20)
    assert "panicked" not in (folder / "said").read_text()


def test_a_plc_scans_finds_and_gets_the_pose(served, made):
    plc = Plc(served)
    assert plc.read()[:1] == [1]
    # What a PLC still writes from before the server's start is no request.
    old = [(plc.number + 9) % 65535 + 1, SCAN]
    assert plc.write(0, old).exception_code == 3 and plc.read()[2:4] == [0, plc.number]
    assert plc.ask(GIVE, 1, 0)[:2] == (3, "nothing was found yet: SCAN, POSE at each stop, FIND, then GIVE")
    plc.recipe("led")
    assert plc.ask(SCAN)[0] == 0
    for k, (_, pose) in enumerate(made.recording()):
        assert not plc.write(4, plc.numbers(np.array(kuka(pose)) * [1000, 1000, 1000, 10000, 10000, 10000])).isError()
        error, words, registers = plc.ask(POSE)
        assert (error, registers[5], registers[6]) == (0, 1, k + 1), words
    error, words, registers = plc.ask(FIND)
    assert error == 0 and registers[5] == 2 and 500 <= registers[7] <= 1000, words
    error, words, registers = plc.ask(GIVE, 1, 0)
    assert error == 0, words
    given = plc.pose(registers)
    (true,) = [part for part in made.truth()["parts"] if part["name"] == "led"]
    part = np.reshape(true["base_T_part"], (4, 4))
    # The insertion pose lies at the part's origin, with the tool's z along the part's, out of it.
    assert np.linalg.norm(given[:3] - part[:3, 3]) < 0.3, (given, part)
    assert axis(given) @ part[:3, 2] > 0.999, (given, part)
    # A panel reads the same, and cannot write while the PLC makes the requests.
    panel = Plc(served, "127.0.0.2")
    assert (panel.pose(panel.read()) == given).all()
    assert panel.write(0, [0]).exception_code == 6
    assert plc.ask(SCAN)[0] == 0


def test_whatever_comes_over_the_wire_the_registers_are_served(served):
    plc, random = Plc(served), np.random.default_rng(5)
    read, write = bytes.fromhex("000100000006010400000079"), bytes.fromhex("00020000000b0110000000020400050009")
    tries = 100_000 if "SHEETLIGHT_LONG" in os.environ else 300
    for k in range(tries):
        frame = bytearray(write if k % 2 else read)
        for _ in range(random.integers(1, 6)):
            frame[random.integers(len(frame))] = random.integers(256)
        frame = frame[: random.integers(1, len(frame) + 1)] if k % 3 == 0 else frame
        with socket.create_connection(("127.0.0.1", served), 5) as wire:
            wire.settimeout(5)
            wire.sendall(frame)
            wire.shutdown(socket.SHUT_WR)
            while wire.recv(512):
                pass
    # What came by chance may be a request, which is answered; the next one is too.
    while plc.read()[2]:
        time.sleep(0.01)
    plc.number = plc.read()[3]
    assert plc.ask(9)[0] == 1


def test_connections_are_counted(served):
    plc = Plc(served)
    wires = [socket.create_connection(("127.0.0.1", served), 5) for _ in range(40)]
    assert plc.read()[0] == 1
    for wire in wires:
        wire.close()
    for _ in range(500):
        time.sleep(0.01)
        try:
            return Plc(served).read()
        except Exception:  # noqa: BLE001, PERF203: until the server has seen that they are closed
            continue
    raise AssertionError("no connection is accepted after forty were closed")


def test_wrong_registers_are_refused_by_modbus_own_codes(served):
    plc = Plc(served)
    assert plc.client.read_input_registers(121, count=1).exception_code == 2
    assert plc.client.read_input_registers(100, count=25).exception_code == 2
    assert plc.write(36, [1]).exception_code == 2
    assert plc.client.read_coils(0, count=1).exception_code == 1
    plc.recipe("led")
    assert plc.client.read_holding_registers(16, count=20).registers == [0x6C65, 0x6400] + [0] * 18
    assert plc.ask(9)[0] == 1
    plc.recipe("../led")
    assert plc.ask(FIND)[0] == 1
    plc.recipe("none")
    plc.ask(SCAN)
    error, words, _ = plc.ask(FIND)
    assert error == 3 and words.startswith("0 shots were taken")
    assert plc.ask(SCAN)[0] == 0
    assert not plc.write(4, plc.numbers([300, 0, 590, 0, 0, 0])).isError()
    error, words, _ = plc.ask(POSE)
    assert error == 2 and words.startswith("the flange would be 0.662 mm from its base")
    # A PLC that writes one register at a time, and the low word first.
    swapped = plc.numbers([300_000, 0, 590_000, 1_800_000, 0, 1_800_000])
    swapped[::2], swapped[1::2] = swapped[1::2], swapped[::2]
    for k, word in enumerate(swapped):
        assert not plc.client.write_register(4 + k, word).isError()
    error, words, _ = plc.ask(POSE)
    assert error == 2 and words.startswith("an angle of 200068.3035 degrees"), words
