"""Cameras in OpenCV's terms, poses in robots' notations, calibrations against the truth."""

from __future__ import annotations

import numpy as np
import pytest

import sheetlight
from sheetlight import SheetlightError


def brown(k, d, points):
    """OpenCV's documented model: k1 k2 p1 p2 k3."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x * x + y * y
    radial = 1 + d[0] * r2 + d[1] * r2**2 + d[4] * r2**3
    u = x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x)
    v = y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y
    return np.stack([k[0, 0] * u + k[0, 2], k[1, 1] * v + k[1, 2]], axis=-1)


def test_opencv_cameras_come_in_and_go_out():
    k = np.array([[1234.5, 0.0, 321.25], [0.0, 1230.0, 245.5], [0.0, 0.0, 1.0]])
    d = np.array([-0.11, 0.03, 1e-3, -5e-4, 0.01])
    camera = sheetlight.Camera.from_opencv(k, d[None], (640, 480))
    assert (camera.matrix == k).all() and (camera.distortion == d).all() and camera.size == (640, 480)
    points = np.array([[10.0, -20.0, 300.0], [-40.0, 25.0, 280.0], [0.0, 0.0, 100.0]])
    pixels = camera.project(points)
    assert np.allclose(pixels, brown(k, d, points), atol=1e-9)
    rays = camera.rays(pixels)
    assert np.allclose(rays, points / np.linalg.norm(points, axis=1, keepdims=True), atol=1e-9)
    assert np.isnan(camera.project([[0.0, 0.0, -1.0]])).all()
    all_terms = np.arange(1, 15) * 1e-4
    assert (sheetlight.Camera.from_opencv(k, all_terms, (640, 480)).distortion == all_terms).all()


@pytest.mark.parametrize(
    ("matrix", "distortion", "word"),
    [
        (np.eye(4), np.zeros(5), "4, 4"),
        (np.array([[1000, 0, 0], [0, 1000, 0], [320, 240, 1.0]]), np.zeros(5), "column"),
        (np.diag([1000.0, 1000.0, 1.0]), np.zeros(6), "6 terms"),
        (np.diag([-1000.0, 1000.0, 1.0]), np.zeros(5), "no camera"),
        (np.diag([np.nan, 1000.0, 1.0]), np.zeros(5), "no camera"),
        (np.diag([1000.0, 1000.0, 1.0]), ["a"], "numbers"),
    ],
)
def test_what_is_no_camera_is_refused(matrix, distortion, word):
    with pytest.raises(SheetlightError, match=word):
        sheetlight.Camera.from_opencv(matrix, distortion, (640, 480))


def test_a_station_of_values_scans_as_the_true_one(made, arrays, scanned, tmp_path):
    truth = made.truth()
    camera = made.station.camera.value
    camera = sheetlight.Camera.from_opencv(camera.matrix, camera.distortion, camera.size)
    plane, pose = truth["laser_plane_camera"], np.reshape(truth["flange_T_camera"], (4, 4))
    values = (camera, plane["normal"], plane["offset_mm"])
    station = sheetlight.Station.from_values(*values, flange_from_camera=pose, folder=tmp_path / "station")
    again = sheetlight.Station(tmp_path / "station")
    assert again.hand_eye.remarks and np.allclose(again.hand_eye.value, pose, atol=1e-9)
    assert station.camera.verdict == "usable" and station.camera.sigma("fx_px") > 0
    points = sheetlight.scan(*arrays[:1], station, arrays[1], on="cpu").points
    far = made.distances(points)
    # Nobody said at which depths points are believed, so a few more are.
    assert len(points) >= 0.99 * len(scanned.points) and np.median(far) < 0.05
    with pytest.raises(SheetlightError, match="long"):
        sheetlight.Station.from_values(camera, [0, 0, 2], 100.0)


def test_notations():
    all_of_them = sheetlight.notations()
    assert len(all_of_them["denso"]) == 6 and "ur" in all_of_them
    pose = sheetlight.pose_from_numbers([400.0, -100.0, 70.0, 10.0, 20.0, 30.0], "denso")
    assert np.allclose(pose[:3, 3], [400, -100, 70])
    for name, labels in all_of_them.items():
        numbers = sheetlight.numbers_from_pose(pose, name)
        assert len(numbers) == len(labels)
        assert np.allclose(sheetlight.pose_from_numbers(numbers, name), pose, atol=1e-6), name
    assert np.allclose(np.array(sheetlight.numbers_from_pose(pose, "ur")[:3]) * 1000, pose[:3, 3])
    with pytest.raises(SheetlightError, match="abacus"):
        sheetlight.numbers_from_pose(pose, "abacus")
    with pytest.raises(SheetlightError):
        sheetlight.pose_from_numbers([1.0, 2.0], "denso")


def test_a_camera_is_calibrated_to_what_it_says(made, tmp_path):
    told = []
    found = sheetlight.calibrate_camera(made.recording("intrinsics"), progress=lambda *t: told.append(t))
    assert (found.kind, found.verdict) == ("camera", "good") and found.reasons and told
    n = len(found.parameters)
    assert found.covariance.shape == (n, n) and np.allclose(found.covariance, found.covariance.T)
    assert np.allclose([found.sigma(p) for p in found.parameters], np.sqrt(np.diag(found.covariance)))
    true = made.station.camera.value
    off = np.abs(found.value.matrix - true.matrix)
    for (i, j), name in {(0, 0): "fx_px", (1, 1): "fy_px", (0, 2): "cx_px", (1, 2): "cy_px"}.items():
        assert off[i, j] < 5 * found.sigma(name), name
    assert len(found.residuals) == len(found.per_picture) and all(r.shape[1] == 4 for r in found.residuals.values())
    rms = np.sqrt(np.mean(np.concatenate([(r[:, 2:] ** 2).sum(axis=1) for r in found.residuals.values()])))
    assert rms == pytest.approx(found.figures["rms_px"], rel=1e-6)
    stored = found.store(tmp_path / "station")
    assert stored.exists() and "<svg" in found.page
    again = sheetlight.Station(tmp_path / "station").camera
    assert (again.value.matrix == found.value.matrix).all() and (again.covariance == found.covariance).all()
    with pytest.raises(SheetlightError, match="camera"):
        sheetlight.calibrate_laser_plane(made.recording("laserplane"), tmp_path)


def test_plane_and_hand_eye_are_calibrated_to_what_they_say(made):
    plane = sheetlight.calibrate_laser_plane(made.recording("laserplane"), made.station, on="cpu")
    true = made.truth("laserplane")["laser_plane_camera"]
    assert plane.kind == "laser_plane" and plane.verdict in ("good", "usable")
    assert np.degrees(np.arccos(min(1.0, abs(plane.value["normal"] @ true["normal"])))) < 0.05
    assert plane.value["offset_mm"] == pytest.approx(true["offset_mm"], abs=0.1)
    eye = sheetlight.calibrate_hand_eye(made.recording("handeye"), made.station, poses="poses_noisy")
    pose = np.reshape(made.truth("handeye")["flange_T_camera"], (4, 4))
    assert eye.kind == "hand_eye" and eye.parameters == ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"]
    off = np.abs(eye.value[:3, 3] - pose[:3, 3])
    assert (off < 5 * np.array([eye.sigma(p) for p in eye.parameters[:3]]) + 1e-3).all()


def test_recordings_are_sequences(recording, arrays):
    assert len(recording) == 120 and recording.size == (640, 480) and recording.bits == 8
    picture, pose = recording[-1]
    assert (picture == arrays[0][119]).all() and (pose == arrays[1][119]).all()
    assert (recording.picture(recording.laser[5]) == arrays[0][5]).all()
    assert (np.stack(recording.flange_poses()) == arrays[1]).all()
    with pytest.raises(IndexError):
        recording[120]
