"""A scan's points as a file of the format that its name ends in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple, Union

import numpy.typing as npt

from .._engine import Scan
from .._error import SheetlightError
from .._organise import organise, some_of
from . import e57, las, parquet, pcd, ply, tiff
from .about import About
from .aside import aside

#: Endings of files in rows and columns.
_ORGANISED = {".ply": ply, ".pcd": pcd, ".tif": tiff, ".tiff": tiff}
#: Endings of files of points.
_POINTS = {".e57": e57, ".las": las, ".laz": las, ".parquet": parquet}


class Saved(NamedTuple):
    """What a file holds and what it does not."""

    #: The file.
    path: Path
    #: Points in it.
    points: int
    #: Points that it has no cell for, because a better one has the same shot and pixel.
    left_out: int
    #: Fields of POINT that the format has no place for.
    lost: tuple[str, ...]


def save(
    scan: Scan,
    path: Union[str, os.PathLike[str]],
    *,
    points: npt.NDArray[Any] | None = None,
    overwrite: bool = False,
) -> Saved:
    """Writes a scan's points as a file that other programs open; the name's ending says the format.

    - .ply, .pcd: an organised cloud (see organise), mm. Units and frame are comments.
    - .tif, .tiff: three float32 pictures x, y and z of the organised cloud, mm, NaN where nothing was measured, for
      HALCON's xyz_to_object_model_3d. Only places are kept.
    - .e57: every point, in metres (the standard's unit), float32, with shot and pixel as row and column. Sigma, quality
      and the place in the picture are lost.
    - .las, .laz: every point, in metres, to 10 nm, everything else in extra bytes.
    - .parquet: every point and field, mm.

    Frame and unit are in every file. `points` are some of the scan's points; without it all. A scan into a folder
    (`out=`) has cloud.ply and cloud.pcd with every point, not organised.

    The file gets its name when it is complete. Raises SheetlightError for a name that is taken (unless `overwrite`), an
    unknown ending, a package that is not installed (the extra `files` has them) and a file that cannot be written.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise SheetlightError(f"path is a {type(path).__name__}, a file's name is needed", "", "give e.g. 'part.e57'")
    file = Path(path)
    ending = file.suffix.lower()
    if ending not in {**_ORGANISED, **_POINTS}:
        raise SheetlightError(
            f"{file} ends in '{file.suffix}', which is no format that is written",
            "the ending says the format",
            f"use one of {', '.join([*_ORGANISED, *_POINTS])}",
        )
    report = scan.report
    about = About(scan.frame, str(report["program"]), (1 << int(report["image"]["bits"])) - 1)
    chosen, left_out = some_of(scan, points), 0
    try:
        with aside(file, overwrite) as part:
            if ending in _ORGANISED:
                organised = organise(scan, points=chosen)
                left_out, lost = organised.left_out, _ORGANISED[ending].LOST
                _ORGANISED[ending].write(part, organised, about)
            else:
                lost = _POINTS[ending].LOST
                _POINTS[ending].write(part, chosen, about)
    except SheetlightError:
        raise
    # The formats' packages have exceptions of their own.
    except Exception as error:
        raise SheetlightError(
            f"{file} cannot be written: {error}",
            "the folder is missing or protected, or the disk is full",
            "make room, or choose another folder; nothing was left under that name",
        ) from error
    return Saved(file, len(chosen) - left_out, left_out, lost)
