"""Points of a scan in rows and columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._dtypes import POINT
from ._engine import Scan
from ._error import SheetlightError


@dataclass(frozen=True)
class Organised:
    """A scan's points in a grid: row i is shot i, column j is pixel j along the stripe."""

    #: Rows x columns of POINT. Where nothing was measured, every number is NaN and `shot` is the row.
    points: npt.NDArray[Any]
    #: Pixel coordinate that the columns count: "u" (columns of the picture) or "v" (its rows).
    along: str
    #: Points that are in no cell, because a better one has the same shot and pixel.
    left_out: int
    #: Frame of x, y and z, which are mm.
    frame: str

    @property
    def measured(self) -> npt.NDArray[np.bool_]:
        """Rows x columns: whether the cell has a point."""
        measured: npt.NDArray[np.bool_] = np.isfinite(self.points["x"])
        return measured


def organise(scan: Scan, *, points: npt.NDArray[Any] | None = None, along: str | None = None) -> Organised:
    """A scan's points in rows of profiles: one row a shot, one column a pixel along the stripe.

    There is a row for every shot up to the last one that was done, also for dark ones, and a column for every pixel of
    the picture. A point goes to the pixel that is nearest to its peak. Where a shot has several points at one pixel
    (steps, echoes), the one of the highest quality stays.

    `points` are some of the scan's points; without it all. `along` is the pixel coordinate along the stripe, "u" or
    "v"; without it the one in which the points of a shot spread more. Raises SheetlightError for a scan without shots
    or points.
    """
    points = some_of(scan, points)
    if along not in (None, "u", "v"):
        raise SheetlightError(f"along is {along!r}, 'u' or 'v' is needed", "", "leave it out: the points tell it")
    places = scan.camera_places
    if not places:
        raise SheetlightError(
            "the scan has no shots, so its points have no rows",
            "the folder is of an imported height map",
            "use scan.map, which has rows and columns",
        )
    along = along or spread_along(points)
    image = scan.report["image"]
    columns = int(image["width" if along == "u" else "height"])
    rows = 1 + max(int(points["shot"].max()), *(shot for shot, _ in places))

    grid = np.empty((rows, columns), POINT)
    for name in POINT.names or ():
        grid[name] = np.arange(rows)[:, None] if name == "shot" else np.nan
    pixel = np.clip(np.rint(points[along]), 0, columns - 1).astype(np.int64)
    cell = points["shot"].astype(np.int64) * columns + pixel
    alone = np.bincount(cell, minlength=rows * columns)[cell] == 1
    grid.reshape(-1)[cell[alone]] = points[alone]
    # Few share a cell: only those are put in order. The best of a cell comes last, and stays.
    several = np.flatnonzero(~alone)
    order = several[np.lexsort((-points["sigma"][several], points["quality"][several], cell[several]))]
    last = np.append(cell[order][1:] != cell[order][:-1], True)[: len(order)]
    best = order[last]
    grid.reshape(-1)[cell[best]] = points[best]
    return Organised(grid, along, len(several) - len(best), scan.frame)


def some_of(scan: Scan, points: npt.NDArray[Any] | None) -> npt.NDArray[Any]:
    """The points that were chosen, or all; raises SheetlightError for what is not a scan's points."""
    chosen = scan.points if points is None else points
    if not isinstance(chosen, np.ndarray) or chosen.dtype != POINT or chosen.ndim != 1:
        is_ = f"an array of {chosen.dtype}, {chosen.shape}" if isinstance(chosen, np.ndarray) else type(chosen).__name__
        raise SheetlightError(
            f"points is {is_}, one row of sheetlight.POINT is needed",
            "points of one picture, rows of N x 3, or a file's own fields",
            "choose from the scan's points, e.g. points=scan.points[scan.points['quality'] > 0.5]",
        )
    if len(chosen) == 0:
        raise SheetlightError(
            "there are no points",
            "no shot showed the stripe, or the choice left none",
            "see scan.report['peaks'] and scan.remarks",
        )
    lost = int((~np.isfinite(np.stack([chosen[axis] for axis in "xyz"]))).any(axis=0).sum())
    if lost:
        raise SheetlightError(
            f"{lost} of {len(chosen)} points have places that are not finite",
            "they were changed after the scan, or are an organised cloud's",
            "leave them out: points[np.isfinite(points['x'])]",
        )
    return chosen


def spread_along(points: npt.NDArray[Any]) -> str:
    """The pixel coordinate in which the points of a shot spread more, summed over the shots."""
    shot = points["shot"]
    count = np.maximum(np.bincount(shot), 1)

    def within(name: str) -> float:
        values = points[name].astype(np.float64)
        middle = np.bincount(shot, values) / count
        return float(((values - middle[shot]) ** 2).sum())

    return "u" if within("u") >= within("v") else "v"
