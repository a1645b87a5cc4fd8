"""Times the Python package beside the program, and batches on one and two workers.

In: the program and the installed package, both built with --release. Out: a table; medians of the rounds, in turns.
The points are compared bit for bit in the same run.

    pip install ./python && python benches/python.py --program target/release/sheetlight
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

import sheetlight

#: Scans in a process of its own and prints what the call took and what the process used before it.
CHILD = """
import sys, time, resource
def cpu():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
import sheetlight
begun, spent = time.perf_counter(), cpu()
sheetlight.scan(sheetlight.Recording(sys.argv[1]), sys.argv[2], on="cpu", out=sys.argv[3])
print(time.perf_counter() - begun, cpu() - spent)
"""


def children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def own() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def timed(cpu, call) -> tuple[float, float]:
    """Seconds on the clock and of the processor."""
    spent, begun = cpu(), time.perf_counter()
    call()
    return time.perf_counter() - begun, cpu() - spent


def row(name: str, figures: list[tuple[float, float]], first: list[tuple[float, float]] | None) -> None:
    wall, cpu = (statistics.median(f[i] for f in figures) for i in (0, 1))
    ratio = ""
    if first is not None:
        # Rounds are paired, because a machine's speed drifts.
        pairs = [(f[0] / b[0], f[1] / b[1]) for f, b in zip(figures, first)]
        ratio = f"  {statistics.median(p[0] for p in pairs):5.3f} of its clock,"
        ratio += f" {statistics.median(p[1] for p in pairs):5.3f} of its CPU"
    print(f"  {name:44} {wall:7.3f} s, {cpu:7.3f} s CPU{ratio}", flush=True)


def one_size(program: str, size: tuple[int, int], shots: int, rounds: int, at: Path) -> None:
    made = sheetlight.simulate(at, sets=["scan"], shots=shots, size=size, seed=3)
    recording, station = made.recording(), made.station
    folder, place = str(recording.folder), str(station.folder)
    pictures, poses = zip(*recording)
    pictures, poses = np.stack(pictures), np.stack(poses)
    figures: dict[str, list[tuple[float, float]]] = {}

    def add(name: str, seconds: tuple[float, float]) -> None:
        figures.setdefault(name, []).append(seconds)

    for k in range(rounds):
        out = [at / f"{who}{k}" for who in ("program", "package")]
        command = [program, "scan", folder, "--station", place, "--out", str(out[0]), "--on", "cpu", "--quiet"]
        add("program, files", timed(children, lambda: subprocess.run(command, check=True, capture_output=True)))
        script = [sys.executable, "-c", CHILD, folder, place, str(out[1])]
        said = []
        run = lambda: said.append(subprocess.run(script, check=True, capture_output=True, text=True).stdout)
        add("package, files, with start and import", timed(children, run))
        add("package, files, the call alone", tuple(map(float, said[0].split())))
        scans = []
        call = lambda: scans.append(sheetlight.scan(pictures, station, poses, on="cpu"))
        add("package, arrays in memory", timed(own, call))
        clouds = [(o / "cloud.ply").read_bytes() for o in out]
        assert clouds[0] == clouds[1], "the clouds of program and package differ"
        assert scans[0].points.tobytes() == sheetlight.Scan.open(out[0]).points.tobytes(), "the arrays' points differ"
    print(f"{size[0]}x{size[1]}, {shots} pictures, {len(scans[0].points)} points, the same bits in all rows")
    first = figures["program, files"]
    for name, seconds in figures.items():
        row(name, seconds, None if seconds is first else first)


def two_threads(at: Path, rounds: int) -> None:
    """Scans of one core each: two in turn, and two threads at once."""
    made = sheetlight.simulate(at, sets=["scan"], shots=200, seed=3)
    pictures, poses = zip(*made.recording())
    pictures, poses = np.stack(pictures), np.stack(poses)
    scan = lambda: sheetlight.scan(pictures, made.station, poses, on="cpu")

    def both() -> None:
        threads = [threading.Thread(target=scan) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    found = [(timed(own, lambda: (scan(), scan())), timed(own, both)) for _ in range(rounds)]
    print("Two scans in one process")
    row("one after the other", [f[0] for f in found], None)
    row("two threads", [f[1] for f in found], [f[0] for f in found])
    busy = statistics.median(f[1][1] / f[1][0] for f in found)
    print(f"  two threads keep {busy:.2f} cores busy")


def workers(program: str, at: Path, recordings: int, rounds: int) -> None:
    """A batch on one and on two workers, each held to one core."""
    archive = at / "archive"
    for k in range(recordings):
        made = sheetlight.simulate(archive / f"{k:03}", sets=["scan"], shots=100, seed=k + 1)
    manifest = archive / "manifest.txt"
    folders = [str(archive / f"{k:03}" / "scan") for k in range(recordings)]
    subprocess.run([program, "batch", "manifest", *folders, "--out", str(manifest)], check=True, capture_output=True)
    figures: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    tables: dict[int, list[bytes]] = {1: [], 2: []}
    alone = dict(os.environ, RAYON_NUM_THREADS="1")
    for k in range(rounds):
        for n in (1, 2):
            out = at / f"batch{n}-{k}"
            command = [sys.executable, "-m", "sheetlight.batch", str(manifest), "--station", str(made.station.folder)]
            command += ["--out", str(out), "--on", "cpu", "--workers", str(n), "--program", program]
            run = lambda: subprocess.run(command, check=True, capture_output=True, env=alone)
            figures[n].append(timed(children, run))
            tables[n].append((out / "recordings.parquet").read_bytes())
    assert len({t for all in tables.values() for t in all}) == 1, "the tables differ"
    print(f"{recordings} recordings of 100 pictures 640x480, one thread a worker, the same tables in all rows")
    row("one worker", figures[1], None)
    row("two workers", figures[2], figures[1])
    print(f"  two workers are {statistics.median(a[0] / b[0] for a, b in zip(figures[1], figures[2])):.2f} times as fast")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/sheetlight", help="the program, built with --release")
    parser.add_argument("--rounds", type=int, default=7, help="rounds of each comparison [default: 7]")
    parser.add_argument("--recordings", type=int, default=64, help="recordings of the batch [default: 64]")
    args = parser.parse_args()
    program = str(Path(args.program).resolve())
    cores = len(os.sched_getaffinity(0))
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    print(json.dumps({"program": version, "python": sys.version.split()[0], "cores": cores}))
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        one_size(program, (640, 480), 1000, args.rounds, at / "small")
        one_size(program, (4096, 3072), 40, args.rounds, at / "large")
        two_threads(at / "threads", args.rounds)
        workers(program, at, args.recordings, 3)


if __name__ == "__main__":
    main()
