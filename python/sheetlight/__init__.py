"""Laser-line scanning: recordings, arrays and calibrations to points, maps and poses.

Lengths are millimetres. Pixel coordinates have integers at pixel centres. A pose is a 4 x 4 matrix that takes points
of one frame to another.
Everything that cannot be done raises `SheetlightError`, which says what happened, why, and what to do next.
"""

from ._convert import log_to_rerun, to_open3d, to_trimesh, to_xarray
from ._dtypes import PICTURE_POINT, POINT, xyz
from ._engine import (
    Calibration,
    Camera,
    Found,
    HeightMap,
    Live,
    Recipe,
    Recording,
    Scan,
    Simulation,
    Station,
    Template,
    __version__,
    calibrate_camera,
    calibrate_hand_eye,
    calibrate_laser_plane,
    find,
    match_template,
    notations,
    numbers_from_pose,
    picture_points,
    pose_from_numbers,
    scan,
    simulate,
    teach,
)
from ._error import SheetlightError
from ._files.save import Saved, save
from ._organise import Organised, organise

__all__ = [
    "PICTURE_POINT",
    "POINT",
    "Calibration",
    "Camera",
    "Found",
    "HeightMap",
    "Live",
    "Organised",
    "Recipe",
    "Recording",
    "Saved",
    "Scan",
    "SheetlightError",
    "Simulation",
    "Station",
    "Template",
    "__version__",
    "calibrate_camera",
    "calibrate_hand_eye",
    "calibrate_laser_plane",
    "find",
    "log_to_rerun",
    "match_template",
    "notations",
    "numbers_from_pose",
    "organise",
    "picture_points",
    "pose_from_numbers",
    "save",
    "scan",
    "simulate",
    "teach",
    "to_open3d",
    "to_trimesh",
    "to_xarray",
    "xyz",
]
