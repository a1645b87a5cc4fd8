"""Scans of recordings, arrays and iterators: the program's points to the last bit, and what ends a scan."""

from __future__ import annotations

import _thread
import os
import signal
import threading
import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sheetlight


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def maps_are_same(a: sheetlight.HeightMap, b: sheetlight.HeightMap) -> bool:
    arrays = all(same(getattr(a, name), getattr(b, name)) for name in ("z", "sigma", "intensity", "count"))
    return arrays and a.cell_mm == b.cell_mm and np.allclose(a.base_from_grid, b.base_from_grid, atol=1e-12)


def test_a_recording_gives_the_programs_points_and_map(scanned, by_program):
    theirs = sheetlight.Scan.open(by_program)
    assert len(theirs.points) > 10_000
    assert same(scanned.points, theirs.points)
    assert maps_are_same(scanned.map, theirs.map)
    # The places scatter and the refinement took that out: what is compared is the whole way.
    assert scanned.report["places"]["taken_out"] == theirs.report["places"]["taken_out"]
    assert scanned.report["peaks"] == theirs.report["peaks"]
    assert scanned.report["median_sigma_mm"] == theirs.report["median_sigma_mm"]
    ours = [place for _, place in scanned.camera_places]
    assert np.allclose(ours, [place for _, place in theirs.camera_places], atol=1e-12)


def test_a_folder_is_what_the_program_writes(recording, station, by_program, tmp_path):
    scan = sheetlight.scan(recording, station, out=tmp_path / "scan", on="cpu")
    assert (tmp_path / "scan/cloud.ply").read_bytes() == (by_program / "cloud.ply").read_bytes()
    assert (tmp_path / "scan/height.tif").read_bytes() == (by_program / "height.tif").read_bytes()
    assert scan.folder == tmp_path / "scan"


def test_arrays_and_iterators_give_the_recordings_points(recording, station, arrays, scanned):
    pictures, poses = arrays
    assert same(sheetlight.scan(pictures, station, poses, on="cpu").points, scanned.points)
    assert same(sheetlight.scan((pair for pair in recording), station, on="cpu").points, scanned.points)
    assert same(sheetlight.scan(iter(pictures), station.folder, list(poses), on="cpu").points, scanned.points)


def test_arrays_into_a_folder(station, arrays, scanned, tmp_path):
    pictures, poses = arrays
    scan = sheetlight.scan(pictures, station, poses, out=tmp_path / "scan", on="cpu")
    assert same(scan.points, scanned.points)
    assert same(sheetlight.Scan.open(tmp_path / "scan").points, scanned.points)


def test_read_only_pictures_are_taken(station, arrays, scanned):
    """Nothing is written into what is given."""
    pictures, poses = arrays[0].copy(), arrays[1].copy()
    pictures.setflags(write=False)
    poses.setflags(write=False)
    assert same(sheetlight.scan(pictures, station, poses, on="cpu").points, scanned.points)


def test_poses_of_scipy(station, arrays, scanned):
    pictures, poses = arrays
    pairs = [(Rotation.from_matrix(p[:3, :3]), p[:3, 3]) for p in poses]
    turned = sheetlight.scan(pictures, station, pairs, on="cpu").points
    # scipy makes the rotation orthonormal in its own way: the last digits differ.
    assert len(turned) == len(scanned.points)
    assert np.abs(sheetlight.xyz(turned) - sheetlight.xyz(scanned.points)).max() < 1e-3


def test_deep_pictures(station, arrays):
    pictures, poses = arrays
    deep = pictures.astype(np.uint16) * 16
    points = sheetlight.scan(deep, station, poses, bits=12, on="cpu").points
    assert len(points) > 10_000 and points["intensity"].max() > 255


def test_points_are_the_surfaces(made, scanned):
    far = made.distances(scanned.points)
    assert np.median(far) < 0.05 and np.isfinite(scanned.points["sigma"]).all()
    assert far.shape == scanned.points.shape


def test_what_arrays_hold(scanned):
    points, map_ = scanned.points, scanned.map
    assert points.dtype == sheetlight.POINT and points.ndim == 1
    assert points["shot"].max() < 120 and (points["sigma"] > 0).all()
    assert map_.z.shape == map_.shape and map_.z.dtype == np.float32
    assert (np.isnan(map_.z) == (map_.count == 0)).all()
    assert np.isnan(map_.z).any() and map_.count.sum() <= len(points)
    assert not points.flags.writeable and not map_.z.flags.writeable
    # A cell's centre, taken to the base, lies on the cloud.
    j, i = np.argwhere(map_.count > 0)[1000]
    in_grid = np.array([(i + 0.5) * map_.cell_mm, (j + 0.5) * map_.cell_mm, map_.z[j, i], 1.0])
    in_base = (map_.base_from_grid @ in_grid)[:3]
    assert np.linalg.norm(sheetlight.xyz(points) - in_base, axis=1).min() < 2 * map_.cell_mm


def test_one_picture(recording, station, scanned):
    picture, pose = recording[60]
    points = sheetlight.picture_points(picture, station, on="cpu")
    assert points.dtype == sheetlight.PICTURE_POINT and len(points) > 100
    # In the base they lie where the scan has them, but for what the refinement moves.
    base_from_camera = dict(scanned.camera_places)[60]
    in_base = sheetlight.xyz(points) @ base_from_camera[:3, :3].T + base_from_camera[:3, 3]
    theirs = sheetlight.xyz(scanned.points[scanned.points["shot"] == 60])
    nearest = np.linalg.norm(theirs[:, None] - in_base[None], axis=2).min(axis=1)
    assert np.median(nearest) < 0.1
    assert np.allclose(pose[3], [0, 0, 0, 1])


def test_live_goes_on_without_growing(recording, station):
    picture = recording[60][0]
    live = sheetlight.Live(station, recording.size, on="cpu")
    assert live.measure(np.zeros_like(picture)) is None
    first = live.measure(picture)

    def resident() -> int:
        return int(open("/proc/self/statm").read().split()[1]) * 4096

    for _ in range(20):
        live.measure(picture)
    before = resident()
    for _ in range(10_000 if "SHEETLIGHT_LONG" in os.environ else 200):
        assert same(live.measure(picture), first)
    grown = resident() - before
    print(f"grown by {grown / 2**20:.1f} MiB")
    assert grown < 20 << 20


def test_progress_is_told(recording, station):
    told = []
    sheetlight.scan(recording, station, on="cpu", progress=lambda done, all: told.append((done, all)))
    assert told[-1] == (120, 120) and [t[0] for t in told] == sorted(t[0] for t in told)


def test_what_progress_raises_ends_the_scan(recording, station, tmp_path):
    def stop(done: int, all: int | None) -> None:
        if done >= 40:
            raise RuntimeError("enough")

    for out in (None, tmp_path / "scan"):
        with pytest.raises(RuntimeError, match="enough"):
            sheetlight.scan(recording, station, out=out, progress=stop)
    assert not (tmp_path / "scan/cloud.ply").exists() and not (tmp_path / "scan/scan.json").exists()
    # What was done is kept and gone on with.
    scan = sheetlight.scan(recording, station, out=tmp_path / "scan", on="cpu", resume=True)
    assert scan.report["shots"] == 120


def test_ctrl_c_ends_a_scan(recording, station):
    # Python ignores Ctrl-C where it was started in the background.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    begun = threading.Event()

    def slow(done: int, all: int | None) -> None:
        begun.set()
        time.sleep(0.05)

    def press() -> None:
        begun.wait(60)
        _thread.interrupt_main()

    presser = threading.Thread(target=press)
    presser.start()
    started = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            sheetlight.scan(recording, station, progress=slow)
    finally:
        signal.signal(signal.SIGINT, before)
    presser.join()
    assert time.monotonic() - started < 0.05 * 120


def test_two_threads_scan_at_once_and_others_run_meanwhile(arrays, station, scanned):
    pictures, poses = arrays
    results: list[np.ndarray] = []
    threads = [
        threading.Thread(target=lambda: results.append(sheetlight.scan(pictures, station, poses, on="cpu").points))
        for _ in range(2)
    ]
    counted, longest = 0, 0.0
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        before = time.monotonic()
        time.sleep(0.001)
        counted, longest = counted + 1, max(longest, time.monotonic() - before)
    assert len(results) == 2 and all(same(r, scanned.points) for r in results)
    # With the interpreter held this thread would have stood still for the whole of both scans.
    assert counted > 20
    print(f"{counted} turns of another thread meanwhile, the longest {longest:.3f} s")
