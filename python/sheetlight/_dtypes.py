"""Fields of the structured arrays, and the places of points as plain rows."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

#: A point of a scan: place and standard deviation (mm), brightness of the stripe (grey levels), 0 (barely believed) to
#: 1, the shot and the place in its picture (px). The record of the scan's cloud.ply.
POINT = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("sigma", "<f4"),
        ("intensity", "<f4"),
        ("quality", "<f4"),
        ("shot", "<u4"),
        ("u", "<f4"),
        ("v", "<f4"),
    ]
)

#: A point of one picture: place in the camera's frame and standard deviation (mm), brightness (grey levels), place in
#: the picture (px).
PICTURE_POINT = np.dtype(
    [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("sigma", "<f4"), ("intensity", "<f4"), ("u", "<f4"), ("v", "<f4")]
)


def xyz(points: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Places of a structured array as rows of N x 3, mm, float64."""
    return np.stack([points["x"], points["y"], points["z"]], axis=-1).astype(np.float64)
