"""Organised clouds as binary PLY.

Every cell is a vertex, row by row. `obj_info num_cols` and `num_rows` tell the shape, which PCL reads. Units, frame
and layout are comments. mm; float32, so no digit is lost.
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
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {about.program}, organised cloud, {about.frame} frame, mm",
        f"comment {layout(organised)}",
        f"obj_info num_cols {columns}",
        f"obj_info num_rows {rows}",
        f"element vertex {grid.size}",
    ]
    lines += [f"property {'int' if field == 'shot' else 'float'} {name}" for field, name in NAMES.items()]
    with open(file, "wb") as out:
        out.write("\n".join([*lines, "end_header", ""]).encode("ascii"))
        grid.tofile(out)
