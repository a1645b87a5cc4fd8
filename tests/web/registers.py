"""In: a port. Out: the registers of docs/connections.md as a PLC's program uses them, by pymodbus, which shares no code with the
server.
Frame and unit: mm, degrees; standard deviations in mm and degrees."""

import time

SCAN, POSE, FIND, GIVE, INSERT, STOP, CALIBRATE = 1, 2, 3, 4, 5, 6, 7
CAMERA, HAND_EYE, LASER_PLANE, POINTER, AXIS = 1, 2, 3, 4, 5
VERDICTS = ["none", "good", "usable", "badly determined", "refused"]
WAITS, RUNS, DONE, FAILED, STOPPED, CUT_OFF = 1, 2, 3, 4, 5, 6
STEPS = ["", "touch", "scan", "find", "approach", "insert", "retract", "done", "backed out"]
# By bit, as the document lists them.
GATES = ["score", "margin", "coverage", "agreement", "edges seen", "edges crossed", "sigma_mm", "sigma_deg", "disagreement_mm", "points that tell the turn", "turn told", "sizes' ratio"]


def present():
    """Whether the package is here."""
    try:
        import pymodbus.client  # noqa: F401
    except ImportError:
        return False
    return True


class Job:
    """Registers 121 to 153, and the words of the error."""

    def __init__(self, client, registers, words):
        integers = lambda a, n: client.convert_from_registers(registers[a - 121 : a - 121 + n], client.DATATYPE.INT32)
        robot = registers[0]
        self.linked, self.armed, self.attended, self.moves, self.look = (bool(robot >> k & 1) for k in range(5))
        self.state, self.procedure, self.error = registers[1], registers[6], registers[7]
        self.step, self.asks = STEPS[registers[2]], STEPS[registers[3]]
        self.number = registers[4] << 16 | registers[5]
        self.ended, self.inserted, self.found = registers[8:11]
        bits = lambda a: registers[a - 121] << 16 | registers[a - 120]
        named = lambda word: {GATES[k] for k in range(len(GATES)) if word >> k & 1}
        self.judged, self.passed = named(bits(132)), named(bits(134))
        self.others = bits(132) >> len(GATES)
        self.pose = [n / scale for n, scale in zip(integers(136, 12), [1000] * 3 + [10_000] * 3)]
        self.sigma = [n / 10_000 for n in registers[27:33]]
        self.words = words

    def __repr__(self):
        return str(vars(self))


class Made:
    """Registers 255 to 361: what a scan or calibration made of its recording."""

    def __init__(self, registers):
        self.target, self.verdict = registers[0], VERDICTS[registers[1]]
        self.shots, self.points = (registers[k] << 16 | registers[k + 1] for k in (2, 4))
        self.recording = b"".join(r.to_bytes(2, "big") for r in registers[7:])[: registers[6]].decode("ascii")

    def __repr__(self):
        return str(vars(self))


class Plc:
    def __init__(self, port, source="127.0.0.1", host="127.0.0.1"):
        from pymodbus.client import ModbusTcpClient

        self.client = ModbusTcpClient(host, port=port, timeout=10, source_address=(source, 0))
        assert self.client.connect()
        self.number = self.read()[3]

    def read(self, address=0, count=121):
        answer = self.client.read_input_registers(address, count=count)
        assert not answer.isError(), answer
        return answer.registers

    def job(self):
        """What stands in the registers of jobs. The words are read again if the job has changed meanwhile."""
        while True:
            registers, said = self.read(121, 33), self.read(154, 101)
            if registers[7:9] == self.read(128, 2):
                letters = b"".join(r.to_bytes(2, "big") for r in said[1:])[: said[0]]
                return Job(self.client, registers, letters.decode("ascii"))

    def made(self):
        return Made(self.read(255, 107))

    def write(self, address, values):
        return self.client.write_registers(address, values)

    def recipe(self, name, sweep_mm=0):
        padded = name.encode("latin-1").ljust(40, b"\0")
        words = [int.from_bytes(padded[i : i + 2], "big") for i in range(0, 40, 2)]
        sweep = self.client.convert_to_registers(round(sweep_mm * 1000), self.client.DATATYPE.INT32)
        assert not self.write(16, words + sweep).isError()

    def ask(self, word, *more):
        """(error, words, all registers) of a request; number and word are written last."""
        self.number = self.number % 65535 + 1
        answer = self.write(0, [self.number, word, *more])
        assert not answer.isError(), answer
        end = time.monotonic() + 60
        while time.monotonic() < end:
            registers = self.read()
            if registers[2] == 0 and registers[3] == self.number:
                data = b"".join(r.to_bytes(2, "big") for r in registers[21:])
                return registers[4], data[: registers[20]].decode("ascii"), registers
            time.sleep(0.01)
        raise AssertionError(f"no answer to {word}")

    def given(self, registers):
        numbers = self.client.convert_from_registers(registers[8:20], self.client.DATATYPE.INT32)
        return [n / scale for n, scale in zip(numbers, [1000] * 3 + [10_000] * 3)]

    def close(self):
        self.client.close()


def plain(words):
    """Words as registers have them: at most 200 plain characters."""
    return "".join(c if " " <= c <= "~" else "?" for c in words)[:200]
