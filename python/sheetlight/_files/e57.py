"""Points as E57 (ASTM E2807).

Every point is written. The standard's unit is the metre; coordinates are float32, which leaves 1 part in 16 million.
`rowIndex` is the shot, `columnIndex` the pixel along the stripe. The scan's name holds the frame and the unit of what
was measured. sigma, quality and the place in the picture have no field.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .._error import SheetlightError
from .._optional import needed
from .cloud import NAMES, Cloud

#: Fields that the format has no place for.
LOST = ("sigma", "quality", "u", "v")
#: pye57 keeps rows and columns as 16-bit numbers.
MOST_SHOTS = 65_535


def write(file: Path, cloud: Cloud) -> None:
    """Writes the points, in metres."""
    pye57 = needed("pye57", "an E57 file", "files")
    points, organised = cloud.points, cloud.organised
    if organised.points.shape[0] > MOST_SHOTS:
        raise SheetlightError(
            f"the scan has {organised.points.shape[0]} shots, an E57 file of this writer has at most {MOST_SHOTS}",
            "rows are 16-bit numbers in pye57",
            "write LAZ or Parquet, or choose points of fewer shots",
        )
    # Rounded here: the file's bounds are then those of the numbers that it holds.
    metres = {axis: (points[axis] / np.float32(1000)).astype(np.float64) for axis in "xyz"}
    data = {f"cartesian{axis.upper()}": values for axis, values in metres.items()}
    data["intensity"] = points["intensity"]
    data["rowIndex"] = points["shot"].astype(np.uint16)
    data["columnIndex"] = np.rint(points[organised.along]).clip(0).astype(np.uint16)
    out = pye57.E57(str(file), mode="w")
    try:
        out.write_scan_raw(data, name=f"{cloud.program}, {cloud.frame} frame, metres")
    finally:
        out.close()
