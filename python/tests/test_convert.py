"""A scan as the objects of other packages."""

from __future__ import annotations

import sys
import types

import numpy as np
import pytest
from conftest import needs

import sheetlight
from sheetlight import SheetlightError


def test_open3d(scanned):
    needs("open3d", heavy=True)
    cloud = sheetlight.to_open3d(scanned)
    points = scanned.points
    assert np.array_equal(cloud.point.positions.numpy(), sheetlight.xyz(points).astype(np.float32))
    for name in ("sigma", "intensity", "quality", "u", "v", "shot"):
        assert np.array_equal(cloud.point[name].numpy()[:, 0], points[name]), name
    assert len(cloud.to_legacy().points) == len(points)


def test_trimesh(made, scanned):
    needs("trimesh")
    mesh = sheetlight.to_trimesh(scanned)
    map_ = scanned.map
    measured = np.isfinite(map_.z)
    assert len(mesh.vertices) == measured.sum() and mesh.units == "mm" and mesh.metadata["frame"] == "base"
    # The first vertex is the first measured cell's centre.
    j, i = np.argwhere(measured)[0]
    centre = map_.base_from_grid @ [(i + 0.5) * map_.cell_mm, (j + 0.5) * map_.cell_mm, map_.z[j, i], 1.0]
    assert np.allclose(mesh.vertices[0], centre[:3], atol=1e-9)
    # It lies on the surface, and its front is up.
    assert np.median(made.distances(np.asarray(mesh.vertices))) < 0.05
    assert (mesh.face_normals @ map_.base_from_grid[:3, 2] > 0).all()
    # An edge joins cells that touch: a diagonal is the longest in the plane.
    in_grid = (np.asarray(mesh.vertices) - map_.base_from_grid[:3, 3]) @ map_.base_from_grid[:3, :3]
    ends = in_grid[mesh.edges][:, :, :2]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() < 1.42 * map_.cell_mm


def test_xarray(scanned):
    needs("xarray")
    data = sheetlight.to_xarray(scanned)
    map_ = scanned.map
    for name, unit in {"z": "mm", "sigma": "mm", "intensity": "grey levels", "count": "points"}.items():
        assert data[name].dims == ("y", "x") and data[name].attrs["units"] == unit
        assert np.array_equal(data[name].values, getattr(map_, name), equal_nan=True)
    cell = data.z.isel(y=30, x=40)
    assert (float(cell.x), float(cell.y)) == (40.5 * map_.cell_mm, 30.5 * map_.cell_mm)
    assert data.x.attrs["units"] == "mm" and data.attrs["frame"] == "base"
    assert np.array_equal(np.reshape(data.attrs["base_from_grid"], (4, 4)), map_.base_from_grid)


def rows_of(chunk) -> tuple[str, list[dict]]:
    """What a chunk of a rerun file holds, but for the clock's times, which Python has no numbers for."""
    batch = chunk.to_record_batch()
    names = [name for name in batch.schema.names if name == "shot" or "3D:" in name]
    return chunk.entity_path, batch.select(names).to_pylist()


def test_rerun(scanned, tmp_path):
    rerun = needs("rerun", heavy=True)
    file = tmp_path / "scan.rrd"
    recording = rerun.RecordingStream("sheetlight")
    recording.save(file)
    sheetlight.log_to_rerun(scanned, recording=recording)
    del recording
    read = [rows_of(chunk) for chunk in needs("rerun.chunk", heavy=True).RrdReader(file).stream()]
    points = scanned.points
    shown = {path: rows for path, rows in read if path.startswith("/scan/points/")}
    assert len(shown) == len(np.unique(points["shot"]))
    (sixty,) = shown["/scan/points/60"]
    assert sixty["shot"] == 60
    assert np.array_equal(sixty["Points3D:positions"], sheetlight.xyz(points[points["shot"] == 60]))
    camera = {row["shot"]: row for path, rows in read if path == "/scan/camera" for row in rows}
    assert sorted(camera) == [shot for shot, _ in scanned.camera_places]
    for shot, place in scanned.camera_places:
        # Column by column, float32.
        turn = np.reshape(camera[shot]["Transform3D:mat3x3"], (3, 3)).T
        assert np.allclose(turn, place[:3, :3], atol=1e-6)
        assert np.allclose(camera[shot]["Transform3D:translation"], place[:3, 3], rtol=1e-6)


@pytest.mark.parametrize(
    ("call", "package", "extra"),
    [
        (sheetlight.to_open3d, "open3d", "open3d"),
        (sheetlight.to_trimesh, "trimesh", "convert"),
        (sheetlight.to_xarray, "xarray", "convert"),
        (sheetlight.log_to_rerun, "rerun", "rerun"),
    ],
)
def test_a_missing_package_says_how_to_install_it(scanned, monkeypatch, call, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(SheetlightError) as raised:
        call(scanned)
    assert package in raised.value.what and f"pip install 'sheetlight[{extra}]'" in raised.value.next


def test_a_scan_without_a_map_has_no_surface(scanned):
    bare = types.SimpleNamespace(map=None, points=scanned.points[:20], frame="base")
    for name, call in {"trimesh": sheetlight.to_trimesh, "xarray": sheetlight.to_xarray}.items():
        needs(name)
        with pytest.raises(SheetlightError, match="20 points are too few"):
            call(bare)
