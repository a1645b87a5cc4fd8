"""A scan as the objects of other packages; each function needs its package only when it is called."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._dtypes import xyz
from ._engine import HeightMap, Scan
from ._error import SheetlightError
from ._optional import needed


def to_open3d(scan: Scan) -> Any:
    """The points as an open3d.t.geometry.PointCloud, mm, in `scan.frame`.

    Attributes are positions (N x 3) and sigma, intensity, quality, u, v (N x 1), float32, and shot (N x 1, int64).
    `.to_legacy()` makes Open3D's older cloud of it, which has places only. Raises SheetlightError without Open3D.
    """
    open3d = needed("open3d", "an Open3D cloud", "open3d")
    points = scan.points
    cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(xyz(points).astype(np.float32)))
    for name in ("sigma", "intensity", "quality", "u", "v"):
        cloud.point[name] = open3d.core.Tensor(np.ascontiguousarray(points[name])[:, None])
    cloud.point["shot"] = open3d.core.Tensor(points["shot"].astype(np.int64)[:, None])
    return cloud


def to_trimesh(scan: Scan) -> Any:
    """The height map as a trimesh.Trimesh, mm, in `scan.frame`.

    A vertex is the centre of a measured cell. Four measured cells beside each other are two triangles, whose front is
    up; holes stay open, and a step is a steep face. Raises SheetlightError without a map or without trimesh.
    """
    trimesh = needed("trimesh", "a mesh", "convert")
    map_ = map_of(scan)
    vertices = cell_centres(map_)
    measured = np.isfinite(map_.z)
    number = np.cumsum(measured).reshape(measured.shape) - 1
    whole = measured[:-1, :-1] & measured[:-1, 1:] & measured[1:, :-1] & measured[1:, 1:]
    a, b = number[:-1, :-1][whole], number[:-1, 1:][whole]
    c, d = number[1:, :-1][whole], number[1:, 1:][whole]
    faces = np.concatenate([np.stack([a, b, d], axis=-1), np.stack([a, d, c], axis=-1)])
    mesh = trimesh.Trimesh(vertices[measured], faces, process=False, metadata={"frame": scan.frame})
    mesh.units = "mm"
    return mesh


def to_xarray(scan: Scan) -> Any:
    """The height map as an xarray.Dataset: z, sigma, intensity, count over (y, x).

    The coordinates x and y are the cells' centres in the grid's frame, mm. Every variable has its unit. The attributes
    are `frame`, `cell_mm`, and `base_from_grid`: 16 numbers, row by row, of the matrix that takes the grid's points to
    that frame. Raises SheetlightError without a map or without xarray.
    """
    xarray = needed("xarray", "a labelled map", "convert")
    map_ = map_of(scan)
    rows, columns = map_.shape
    units = {"z": "mm", "sigma": "mm", "intensity": "grey levels", "count": "points"}
    return xarray.Dataset(
        {name: (("y", "x"), getattr(map_, name), {"units": unit}) for name, unit in units.items()},
        coords={
            "x": ("x", (np.arange(columns) + 0.5) * map_.cell_mm, {"units": "mm"}),
            "y": ("y", (np.arange(rows) + 0.5) * map_.cell_mm, {"units": "mm"}),
        },
        attrs={
            "frame": scan.frame,
            "cell_mm": map_.cell_mm,
            "base_from_grid": map_.base_from_grid.ravel(),
        },
    )


def log_to_rerun(scan: Scan, entity: str = "scan", *, recording: Any = None) -> None:
    """Logs a scan to rerun: points and the camera's places over the timeline `shot`, mm, in `scan.frame`.

    `ENTITY/points/SHOT` are a shot's points from that shot on, grey by their brightness; `ENTITY/camera` is where the
    camera stood. `recording` is a rerun.RecordingStream; without it the global one, which rerun.init makes. Raises
    SheetlightError without rerun.
    """
    rerun = needed("rerun", "a rerun recording", "rerun")
    points = scan.points
    # The median of the brightest half is white enough; one glint does not make the rest dark.
    white = float(np.quantile(points["intensity"], 0.75)) if len(points) else 1.0
    grey = (np.clip(points["intensity"] / white, 0.0, 1.0) * 255).astype(np.uint8)
    ends = np.searchsorted(points["shot"], [[shot, shot + 1] for shot, _ in scan.camera_places])
    for (shot, place), (begin, end) in zip(scan.camera_places, ends):
        rerun.set_time("shot", sequence=shot, recording=recording)
        camera = rerun.Transform3D(translation=place[:3, 3], mat3x3=place[:3, :3])
        rerun.log(f"{entity}/camera", camera, recording=recording)
        if begin < end:
            colours = np.repeat(grey[begin:end, None], 3, axis=1)
            seen = rerun.Points3D(xyz(points[begin:end]), colors=colours)
            rerun.log(f"{entity}/points/{shot}", seen, recording=recording)


def map_of(scan: Scan) -> HeightMap:
    """The height map; raises SheetlightError where there is none."""
    if scan.map is None:
        raise SheetlightError(
            f"the scan has no height map: {len(scan.points)} points are too few",
            "hardly a shot showed the stripe",
            "see scan.report['peaks'] and scan.remarks",
        )
    return scan.map


def cell_centres(map_: HeightMap) -> npt.NDArray[np.float64]:
    """Rows x columns x 3: where the map's cells lie in the points' frame, mm; NaN where nothing was measured."""
    rows, columns = map_.shape
    x, y = np.meshgrid((np.arange(columns) + 0.5) * map_.cell_mm, (np.arange(rows) + 0.5) * map_.cell_mm)
    in_grid = np.stack([x, y, map_.z], axis=-1)
    turn, place = map_.base_from_grid[:3, :3], map_.base_from_grid[:3, 3]
    centres: npt.NDArray[np.float64] = in_grid @ turn.T + place
    return centres
