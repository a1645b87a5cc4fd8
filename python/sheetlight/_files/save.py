"""A scan's points as a file of the format that its name ends in."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Union

import numpy.typing as npt

from .._engine import Scan
from .._error import SheetlightError
from .._organise import organise, some_of
from . import e57, las, parquet, pcd, ply, tiff
from .aside import aside
from .cloud import Cloud


class _Format(NamedTuple):
    """A format: its writer, whether it is in rows and columns, what it has no place for."""

    write: Callable[[Path, Cloud], None]
    organised: bool
    lost: tuple[str, ...]


_FORMATS = {
    ".ply": _Format(ply.write, True, ply.LOST),
    ".pcd": _Format(pcd.write, True, pcd.LOST),
    ".tif": _Format(tiff.write, True, tiff.LOST),
    ".tiff": _Format(tiff.write, True, tiff.LOST),
    ".e57": _Format(e57.write, False, e57.LOST),
    ".las": _Format(las.write, False, las.LOST),
    ".laz": _Format(las.write, False, las.LOST),
    ".parquet": _Format(parquet.write, False, parquet.LOST),
}


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
    form = _FORMATS.get(file.suffix.lower())
    if form is None:
        raise SheetlightError(
            f"{file} ends in '{file.suffix}', which is no format that is written",
            "the ending says the format",
            f"use one of {', '.join(_FORMATS)}",
        )
    report = scan.report
    chosen = some_of(scan, points)
    organised = organise(scan, points=chosen)
    full_scale = (1 << int(report["image"]["bits"])) - 1
    cloud = Cloud(chosen, organised, scan.frame, str(report["program"]), full_scale)
    try:
        with aside(file, overwrite) as part:
            form.write(part, cloud)
    except SheetlightError:
        raise
    # The formats' packages have exceptions of their own.
    except Exception as error:
        raise SheetlightError(
            f"{file} cannot be written: {error}",
            "the folder is missing or protected, or the disk is full",
            "make room, or choose another folder; nothing was left under that name",
        ) from error
    left_out = organised.left_out if form.organised else 0
    return Saved(file, len(chosen) - left_out, left_out, form.lost)
