"""Organised clouds as binary PCD of the Point Cloud Library.

WIDTH is the number of pixels along the stripe, HEIGHT the number of shots. Units, frame and layout are comments. mm;
float32, so no digit is lost.
"""

from __future__ import annotations

from pathlib import Path

from .._organise import Organised
from .about import NAMES, About, layout

#: Fields that the format has no place for.
LOST: tuple[str, ...] = ()


def write(file: Path, organised: Organised, about: About) -> None:
    """Writes the organised cloud."""
    grid = organised.points
    rows, columns = grid.shape
    n = len(NAMES)
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        f"# {about.program}, organised cloud, {about.frame} frame, mm",
        f"# {layout(organised)}",
        "VERSION 0.7",
        f"FIELDS {' '.join(NAMES.values())}",
        f"SIZE {' '.join(['4'] * n)}",
        f"TYPE {' '.join('U' if field == 'shot' else 'F' for field in NAMES)}",
        f"COUNT {' '.join(['1'] * n)}",
        f"WIDTH {columns}",
        f"HEIGHT {rows}",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {grid.size}",
        "DATA binary",
    ]
    with open(file, "wb") as out:
        out.write("\n".join([*lines, ""]).encode("ascii"))
        grid.tofile(out)
