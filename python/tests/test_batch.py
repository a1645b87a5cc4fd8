"""Batches on several workers give the bytes of a single run. SHEETLIGHT_LONG: 64 recordings instead of 8."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import ROOT, needs

import sheetlight
from sheetlight.batch import Batch, run
from sheetlight.batch.shard import Went
from sheetlight.batch.workers import Lost

LONG = "SHEETLIGHT_LONG" in os.environ
MANY = 64 if LONG else 8


def program(*words: object, code: int = 0) -> subprocess.CompletedProcess[str]:
    if "SHEETLIGHT_PROGRAM" not in os.environ:
        pytest.skip("SHEETLIGHT_PROGRAM names no program to run")
    command = [os.environ["SHEETLIGHT_PROGRAM"], *map(str, words), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """A station, and copies of one recording in which the robot reports other places."""
    folder = tmp_path_factory.mktemp("archive")
    rig = ROOT / "data/rigs/paper.toml"
    program("simulate", "--out", folder / "sim", "--rig", rig, "--seed", 3, "--width", 320)
    for k in range(MANY):
        copy = folder / "recordings" / str(k)
        shutil.copytree(folder / "sim/scan", copy, ignore=shutil.ignore_patterns("*.ply", "truth.json"))
        poses = json.loads((copy / "poses.json").read_text())
        for pose in poses["poses"]:
            pose["matrix"][3] += 0.05 * k
        (copy / "poses.json").write_text(json.dumps(poses))
    program("batch", "manifest", folder / "recordings", "--out", folder / "manifest.txt")
    return folder


def words(archive: Path, out: Path) -> list[str]:
    found = [archive / "manifest.txt", "--station", archive / "sim/station", "--recipe", archive / "sim/notched.toml"]
    return [*map(str, found), "--out", str(out), "--on", "cpu"]


def files(folder: Path) -> dict[str, bytes]:
    found = [f for f in folder.rglob("*") if f.is_file() and f.suffix != ".lock"]
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(found)}


@pytest.fixture(scope="module")
def single(archive, tmp_path_factory):
    """What one process makes of it."""
    out = tmp_path_factory.mktemp("single") / "out"
    program("batch", *words(archive, out))
    found = files(out)
    assert {"recordings.parquet", "shots.parquet", "matches.parquet", "figures.parquet"} < set(found)
    return found


def same(out: Path, wanted: dict[str, bytes]) -> None:
    found = files(out)
    assert sorted(found) == sorted(wanted)
    assert [name for name in wanted if found[name] != wanted[name]] == []


def start(archive: Path, out: Path, *more: str) -> subprocess.Popen[str]:
    place = str(Path(sheetlight.__file__).parents[1])
    command = [sys.executable, "-m", "sheetlight.batch", *words(archive, out), *more]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([place, os.environ.get("PYTHONPATH", "")])}
    command += ["--program", os.environ["SHEETLIGHT_PROGRAM"]]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env)


def errors(told: str) -> int:
    """Lines that begin an error."""
    return sum(line.startswith("error: ") for line in told.splitlines())


def below(pid: int) -> list[int]:
    """Processes that a process started, and those that they started."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    try:
        children = [int(c) for task in tasks for c in task.read_text().split()]
    except OSError:
        return []
    return children + [c for child in children for c in below(child)]


def command_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    except OSError:
        return ""


def kill_one(driver: int, holds: str, killed: set[int], seconds: float = 90) -> bool:
    """Kills another process below the driver whose command has these words; waits for one."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        for pid in below(driver):
            if pid not in killed and holds in command_of(pid):
                killed.add(pid)
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    continue
                return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_workers_give_the_bytes_of_one_run_though_three_are_killed(archive, single, tmp_path, workers):
    out = tmp_path / "out"
    driver = start(archive, out, "--workers", str(workers), "--shards", str(MANY))
    # At once: a fast machine has few shards left a tenth of a second later.
    killed: set[int] = set()
    for _ in range(3):
        assert kill_one(driver.pid, "--shard ", killed), "no worker was seen"
    said, told = driver.communicate(timeout=900)
    assert driver.returncode == 0, told
    assert told.count("was lost with shard") == 3, told
    assert len(said.splitlines()) == MANY and {json.loads(line)["state"] for line in said.splitlines()} == {"done"}
    same(out, single)


def test_a_driver_that_was_killed_is_started_again(archive, single, tmp_path):
    out = tmp_path / "out"
    driver = start(archive, out, "--workers", "2")
    until = time.monotonic() + 300
    while not list(out.glob("results/*/*/result.json")):
        assert time.monotonic() < until and driver.poll() is None
        time.sleep(0.01)
    driver.kill()
    driver.communicate()
    again = start(archive, out, "--workers", "2")
    said, told = again.communicate(timeout=900)
    assert again.returncode == 0, told
    assert any(not json.loads(line)["made"] for line in said.splitlines()), "what was done is not done again"
    same(out, single)


class Sick:
    """A worker whose disk is full, or that is lost each time."""

    name = "sick"

    def __init__(self, error: dict[str, str] | None) -> None:
        self.error, self.runs = error, 0

    def run(self, command, heard):
        self.runs += 1
        if self.error is None:
            raise Lost("its process was ended by signal 9")
        return Went(1, [], self.error)

    def close(self) -> None:
        pass


FULL = {"kind": "output", "what": "out: cannot be written", "cause": "the disk is full", "next": "free some space"}


def test_a_full_disk_retires_one_worker_and_the_others_go_on(archive, single, tmp_path):
    from sheetlight.batch.workers import Local

    sick, said = Sick(FULL), []
    batch = Batch(os.environ["SHEETLIGHT_PROGRAM"], words(archive, tmp_path / "out"), str(tmp_path / "out"))
    ended = run(batch, [sick, Local(2)], say=said.append)
    assert ended.complete and sick.runs == 1 and len(said) == 1
    assert "is retired" in said[0] and "the disk is full" in said[0] and "next step: free some space" in said[0]
    same(tmp_path / "out", single)


def test_a_batch_that_no_worker_can_go_on_with_ends_with_one_error(archive, tmp_path):
    def failed(worker: Sick) -> sheetlight.SheetlightError:
        out = tmp_path / str(worker.error is None)
        batch = Batch(os.environ["SHEETLIGHT_PROGRAM"], words(archive, out), str(out))
        with pytest.raises(sheetlight.SheetlightError) as raised:
            run(batch, [worker], shards=4, say=lambda text: None)
        assert raised.value.cause and raised.value.next
        assert not (out / "recordings.parquet").exists()
        return raised.value

    assert "4 of 4 shards are not done: all of 1 workers were retired" in failed(Sick(FULL)).what
    error = failed(Sick(None))
    assert "lost its worker 6 times, 5 are tried" in error.what


@pytest.mark.parametrize(
    ("more", "code", "what"),
    [
        ([], 2, "0 workers are named, 1 or more needed"),
        (["--workers", "0"], 2, "--workers is 0, 1 or more needed"),
        (["--workers", "1", "--set", "threshold.minimum=14"], 2, "contains another batch: its settings"),
        (["--workers", "1", "--on", "moon"], 2, "moon"),
    ],
)
def test_wrong_use_is_one_error(archive, tmp_path, more, code, what):
    out = tmp_path / "out"
    program("batch", *words(archive, out), "--plan")
    driver = start(archive, out, *more)
    _, told = driver.communicate(timeout=60)
    assert driver.returncode == code and what in told and errors(told) <= 1, told


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A Ray cluster on this machine, started as its users start one."""
    needs("ray", heavy=True)
    ray = [sys.executable, "-m", "ray.scripts.scripts"]
    folder = tmp_path_factory.mktemp("ray")
    # Sockets of a long folder's name are refused.
    short = Path("/tmp") / f"ray-{os.getpid()}"
    options = ["--head", "--num-cpus=2", "--port=0", "--include-dashboard=false", "--disable-usage-stats"]
    log = (folder / "log").open("w+")
    # Its own, so that neither an existing token is used nor the cluster is open to others.
    os.environ.update(RAY_AUTH_MODE="token", RAY_AUTH_TOKEN=secrets.token_hex(32))
    head = subprocess.Popen([*ray, "start", "--block", *options, f"--temp-dir={short}"], stdout=log, stderr=log)
    until = time.monotonic() + 120
    address = None
    while address is None:
        assert time.monotonic() < until and head.poll() is None, (folder / "log").read_text()
        found = [w.strip("'\",") for w in (folder / "log").read_text().split() if w.startswith("--address=")]
        address = found[0].removeprefix("--address=").strip("'\"") if found else None
        time.sleep(0.5)
    yield address, head
    for pid in [*below(head.pid), head.pid]:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    head.wait()
    shutil.rmtree(short, ignore_errors=True)


def test_ray_gives_the_bytes_of_one_run_though_three_actors_are_killed(archive, single, tmp_path, cluster):
    address, head = cluster
    out = tmp_path / "out"
    driver = start(archive, out, "--ray", address, "--workers", "2", "--shards", str(MANY // 2))
    killed: list[int] = []
    until = time.monotonic() + 300
    while len(killed) < 3 and driver.poll() is None and time.monotonic() < until:
        actors = [p for p in below(head.pid) if "ray::Runner" in command_of(p) and p not in killed]
        if actors:
            # With a shard in its hands.
            os.kill(actors[0], signal.SIGKILL)
            killed.append(actors[0])
        time.sleep(0.3)
    said, told = driver.communicate(timeout=900)
    assert driver.returncode == 0, told
    assert len(killed) == 3 and "was lost with shard" in told, (killed, told)
    assert len(said.splitlines()) == MANY
    same(out, single)


def test_a_cluster_that_loses_its_head_is_one_error_and_nothing_is_half_written(archive, single, tmp_path, cluster):
    """The last test of the cluster: it is gone afterwards."""
    address, head = cluster
    out = tmp_path / "out"
    driver = start(archive, out, "--ray", address, "--workers", "1", "--shards", str(MANY))
    until = time.monotonic() + 300
    while not list(out.glob("results/*/*/result.json")):
        assert time.monotonic() < until and driver.poll() is None, driver.communicate()[1]
        time.sleep(0.05)
    assert kill_one(head.pid, "gcs_server", set())
    _, told = driver.communicate(timeout=300)
    assert driver.returncode == 1, told
    assert "the head of the Ray cluster at" in told and "next step: start the cluster again" in told, told
    assert errors(told) == 1, told
    found = {name: text for name, text in files(out).items() if not name.startswith("work/")}
    assert all(single[name] == text for name, text in found.items())
    # Without a cluster the same batch goes on.
    again = start(archive, out, "--workers", "1")
    _, told = again.communicate(timeout=900)
    assert again.returncode == 0, told
    same(out, single)


def test_a_cluster_that_is_not_there_is_one_error(archive, tmp_path):
    needs("ray", heavy=True)
    driver = start(archive, tmp_path / "out", "--ray", "127.0.0.1:1")
    _, told = driver.communicate(timeout=300)
    assert driver.returncode == 1 and errors(told) == 1, told
    assert "no Ray cluster answers at '127.0.0.1:1'" in told and "next step" in told


def test_the_examples_drift_is_the_one_that_was_simulated(tmp_path):
    """examples/archives/drift.py asks the tables with DuckDB."""
    needs("duckdb")
    needs("matplotlib")
    if "SHEETLIGHT_PROGRAM" not in os.environ:
        pytest.skip("SHEETLIGHT_PROGRAM names no program to run")
    example = ROOT / "examples/archives/drift.py"
    command = [sys.executable, example, tmp_path, "--program", os.environ["SHEETLIGHT_PROGRAM"], "--scans", str(MANY)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["scans"] == MANY and 0.003 < told["rms_mm"] < 0.03, told
    assert (tmp_path / "drift.png").stat().st_size > 5000
