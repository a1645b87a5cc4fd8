"""Points as LAS 1.4 or LAZ, point format 6.

Every point is written, in metres, which readers assume. The coordinate system is a local one: its WKT names frame and
unit. Coordinates are whole multiples of 10 nm, of more where the cloud is larger than 42 m. `intensity` is stretched
to 16 bits, as the specification wants; everything else is in extra bytes, with the level itself, so nothing is lost.
"""

from __future__ import annotations

from math import ceil, log10
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._optional import needed
from .about import About

#: Fields that the format has no place for.
LOST: tuple[str, ...] = ()
#: Extra bytes: name, field of POINT, type, and what it is (32 characters at most).
EXTRA = (
    ("sigma_mm", "sigma", "float32", "1 sigma, worst direction, mm"),
    ("level", "intensity", "float32", "stripe amplitude, grey levels"),
    ("quality", "quality", "float32", "0 barely believed, to 1"),
    ("shot", "shot", "uint32", "number of the picture"),
    ("u", "u", "float32", "column in the picture, px"),
    ("v", "v", "float32", "row in the picture, px"),
)
#: Smallest step, metres: below what float32 resolves of most points in mm.
STEP = 1e-8
#: Steps that a coordinate's 32 bits reach to each side of the offset.
REACH = 2**31 - 1


def write(file: Path, points: npt.NDArray[Any], about: About) -> None:
    """Writes LAZ where the name ends so, else LAS."""
    laspy = needed("laspy", "a LAS or LAZ file", "files")
    if file.suffix.lower() == ".laz":
        needed("lazrs", "a LAZ file", "files")
    metres = np.stack([points[axis] for axis in "xyz"], axis=-1).astype(np.float64) / 1000
    middle = np.round((metres.min(axis=0) + metres.max(axis=0)) / 2, 3)
    half = np.abs(metres - middle).max()
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets = middle
    header.scales = np.full(3, max(STEP, 10.0 ** ceil(log10(max(half, STEP) / REACH))))
    header.generating_software = about.program[:32]
    header.system_identifier = "laser line scan"
    header.global_encoding.wkt = True
    header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "OGC WKT", local_system(about.frame).encode() + b"\0"))
    header.add_extra_dims([laspy.ExtraBytesParams(name, kind, what) for name, _, kind, what in EXTRA])
    las = laspy.LasData(header)
    las.x, las.y, las.z = metres.T
    stretched = np.rint(points["intensity"] * (65_535 / about.full_scale))
    las.intensity = stretched.clip(0, 65_535).astype(np.uint16)
    las.return_number[:] = 1
    las.number_of_returns[:] = 1
    for name, field, _, _ in EXTRA:
        las[name] = points[field]
    las.write(str(file))


def local_system(frame: str) -> str:
    """A local coordinate system in metres, as WKT of OGC 01-009."""
    axes = "".join(f',AXIS["{axis}",OTHER]' for axis in "xyz")
    return f'LOCAL_CS["{frame} frame",LOCAL_DATUM["{frame}",0],UNIT["metre",1]{axes}]'
