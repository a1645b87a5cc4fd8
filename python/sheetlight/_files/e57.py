"""Points as E57 (ASTM E2807).

Every point is written. The standard's unit is the metre; coordinates are float32, which leaves 1 part in 16 million.
`rowIndex` is the shot, `columnIndex` the pixel along the stripe. The scan's name holds the frame and the unit of what
was measured. sigma, quality and the place in the picture have no field.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._error import SheetlightError
from .._optional import needed
from .._organise import spread_along
from .about import About

#: Fields that the format has no place for.
LOST = ("sigma", "quality", "u", "v")
#: pye57 keeps rows and columns as 16-bit numbers.
LAST_SHOT = 65_535


def write(file: Path, points: npt.NDArray[Any], about: About) -> None:
    """Writes the points, in metres."""
    pye57 = needed("pye57", "an E57 file", "files")
    last = int(points["shot"].max())
    if last > LAST_SHOT:
        raise SheetlightError(
            f"there are points of shot {last}, an E57 file of this writer reaches to shot {LAST_SHOT}",
            "rows are 16-bit numbers in pye57",
            "write LAZ or Parquet, or choose points of earlier shots",
        )
    # Rounded here: the file's bounds are then those of the numbers that it holds.
    metres = {axis: (points[axis] / np.float32(1000)).astype(np.float64) for axis in "xyz"}
    data = {f"cartesian{axis.upper()}": values for axis, values in metres.items()}
    data["intensity"] = points["intensity"]
    data["rowIndex"] = points["shot"].astype(np.uint16)
    data["columnIndex"] = np.rint(points[spread_along(points)]).clip(0).astype(np.uint16)
    out = pye57.E57(str(file), mode="w")
    try:
        out.write_scan_raw(data, name=f"{about.program}, {about.frame} frame, metres")
    finally:
        out.close()
