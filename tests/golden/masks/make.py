#!/usr/bin/env python3
# In: nothing (seeded noise). Out: small pictures, their masks by cv2.adaptiveThreshold and the skeletons of some by
# cv2.ximgproc.thinning, stacked in PNG files beside this script; list.json says what each is and which OpenCV made it.
# Frame and unit: pixels. Needs opencv-contrib-python and numpy; tests/scan/masks.rs compares the stages with the files.
import json
import pathlib

import cv2
import numpy as np

HERE = pathlib.Path(__file__).parent
METHODS = {"mean": cv2.ADAPTIVE_THRESH_MEAN_C, "gaussian": cv2.ADAPTIVE_THRESH_GAUSSIAN_C}
RULES = {"zhang-suen": cv2.ximgproc.THINNING_ZHANGSUEN, "guo-hall": cv2.ximgproc.THINNING_GUOHALL}


def stripe(width, height, sigma, seed):
    """A curved stripe with a jump, reflections, shot and read noise."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    centre = height * (0.5 + 0.2 * np.sin(5 * x / width + seed)) + np.where(x > 0.6 * width, 0.1 * height, 0)
    light = 180 * np.exp(-0.5 * ((y - centre) / sigma) ** 2)
    for _ in range(4):
        u, v, r = rng.uniform(0, width), rng.uniform(0, height), rng.uniform(2, 9)
        light += 230 * np.exp(-0.5 * ((x - u) ** 2 + (y - v) ** 2) / r**2)
    light += 10 + rng.normal(0, 2, light.shape) + np.sqrt(0.1 * light) * rng.normal(0, 1, light.shape)
    return np.clip(np.round(light), 0, 255).astype(np.uint8)


def pictures():
    rng = np.random.default_rng(5)
    yield "stripe", stripe(321, 141, 3.0, 1)
    yield "wide", stripe(203, 159, 9.0, 2)
    yield "noise", rng.integers(0, 256, (67, 129), dtype=np.uint8)
    ramp = np.add.outer(np.arange(90) * 2, np.arange(131)) + rng.integers(0, 3, (90, 131))
    yield "ramp", (ramp % 256).astype(np.uint8)


CASES = [(3, 0), (3, 4), (5, -3), (7, 6), (11, -1), (15, 10), (31, 6), (31, 20), (51, 2), (75, 12), (99, 0), (101, 8)]
made = {"opencv": cv2.__version__, "pictures": []}
for name, picture in pictures():
    masks, skeletons, entry = [], [], {"name": name, "masks": [], "skeletons": []}
    for size, offset in CASES:
        for method, flag in METHODS.items():
            # OpenCV subtracts its constant from the mean, Sheetlight the offset from the pixel.
            mask = cv2.adaptiveThreshold(picture, 255, flag, cv2.THRESH_BINARY, size, -offset)
            masks.append(mask)
            entry["masks"].append({"window": method, "size": size, "offset": offset})
            if size in (3, 31, 101) and method == "mean":
                for rule, thinning in RULES.items():
                    skeletons.append(cv2.ximgproc.thinning(mask, thinningType=thinning))
                    entry["skeletons"].append({"thinning": rule, "mask": len(masks) - 1})
    for kind, stack in (("picture", [picture]), ("masks", masks), ("skeletons", skeletons)):
        cv2.imwrite(str(HERE / f"{name}_{kind}.png"), np.vstack(stack), [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_BILEVEL, int(kind != "picture")])
    made["pictures"].append(entry)
(HERE / "list.json").write_text(json.dumps(made, indent=1) + "\n")
