"""Points as an Apache Parquet table.

Every point is a row and every field a column, in mm, px and grey levels. The file's metadata (key `sheetlight`, JSON)
has units, frame and program, and each column's metadata has its unit. Nothing is lost.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy.typing as npt

from .._dtypes import POINT
from .._optional import needed
from .about import NAMES, About

#: Fields that the format has no place for.
LOST: tuple[str, ...] = ()
#: Units of POINT's fields.
UNITS = {
    "x": "mm",
    "y": "mm",
    "z": "mm",
    "sigma": "mm",
    "intensity": "grey levels",
    "quality": "0 to 1",
    "shot": "number of the picture",
    "u": "px",
    "v": "px",
}


def write(file: Path, points: npt.NDArray[Any], about: About) -> None:
    """Writes the table."""
    arrow = needed("pyarrow", "a Parquet file", "files")
    parquet = needed("pyarrow.parquet", "a Parquet file", "files")

    def column(field: str) -> object:
        kind = arrow.from_numpy_dtype(POINT[field])
        return arrow.field(NAMES[field], kind, nullable=False, metadata={"unit": UNITS[field]})

    said = {"units": "mm", "frame": about.frame, "program": about.program}
    schema = arrow.schema([column(field) for field in NAMES], metadata={"sheetlight": json.dumps(said)})
    columns = [arrow.array(points[field]) for field in NAMES]
    parquet.write_table(arrow.table(columns, schema=schema), str(file))
