"""Organised clouds as a TIFF of three float pictures, x, y and z, for HALCON's xyz_to_object_model_3d.

Row and column of a pixel are shot and pixel along the stripe; NaN where nothing was measured. mm, float32, so no digit
is lost. Each picture's description names axis, unit and frame. Everything but places is lost.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .._optional import needed
from .._organise import Organised
from .about import About, layout

#: Fields that the format has no place for.
LOST = ("sigma", "intensity", "quality", "u", "v")


def write(file: Path, organised: Organised, about: About) -> None:
    """Writes the three pictures."""
    tifffile = needed("tifffile", "a TIFF of x, y and z", "files")
    grid = organised.points
    with tifffile.TiffWriter(str(file)) as out:
        for axis in "xyz":
            out.write(
                np.ascontiguousarray(grid[axis]),
                photometric="minisblack",
                description=f"{axis}, mm, {about.frame} frame; {layout(organised)}",
                software=about.program,
                metadata=None,
                contiguous=False,
            )
