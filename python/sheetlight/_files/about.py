"""What files say of a scan's points."""

from __future__ import annotations

from dataclasses import dataclass

from .._organise import Organised


@dataclass(frozen=True)
class About:
    """What is true of all points of a scan."""

    #: Frame of x, y and z, which are mm.
    frame: str
    #: Name and version of the program that measured them.
    program: str
    #: Highest grey level of the sensor.
    full_scale: int


#: Names of POINT's fields in files: lengths show their unit, as in a scan's own cloud.ply.
NAMES = {
    "x": "x",
    "y": "y",
    "z": "z",
    "sigma": "sigma_mm",
    "intensity": "intensity",
    "quality": "quality",
    "shot": "shot",
    "u": "u",
    "v": "v",
}


def layout(organised: Organised) -> str:
    """How the rows and columns of a file are to be read."""
    return f"row = shot, column = pixel along the stripe ({organised.along} of the picture), nan = not measured"
