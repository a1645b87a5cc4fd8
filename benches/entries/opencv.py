"""OpenCV's chain as people write it: adaptive threshold, thinning of the whole picture, a point for each pixel left.

With --tiles, thinning runs only in tiles of 256 pixels that contain light.
"""
import sys

import cv2
import numpy as np
from entry import serve

SIZE, OFFSET = 31, 8
# Thinning moves by one pixel a step: a margin of 32 gives the pixels of the whole picture.
TILE, AROUND = 256, 32


def thinned(lit):
    return cv2.ximgproc.thinning(lit, thinningType=cv2.ximgproc.THINNING_ZHANGSUEN)


def by_tiles(lit):
    thin = np.zeros_like(lit)
    for y in range(0, lit.shape[0], TILE):
        for x in range(0, lit.shape[1], TILE):
            if cv2.hasNonZero(lit[y : y + TILE, x : x + TILE]):
                top, left = max(y - AROUND, 0), max(x - AROUND, 0)
                part = thinned(lit[top : y + TILE + AROUND, left : x + TILE + AROUND])
                to = thin[y : y + TILE, x : x + TILE]
                to[:] = part[y - top : y - top + to.shape[0], x - left : x - left + to.shape[1]]
    return thin


def main():
    tiles = "--tiles" in sys.argv[1:]

    def centres(picture):
        mean = cv2.ADAPTIVE_THRESH_MEAN_C
        lit = cv2.adaptiveThreshold(picture, 255, mean, cv2.THRESH_BINARY, SIZE, -OFFSET)
        pixels = cv2.findNonZero((by_tiles if tiles else thinned)(lit))
        return np.empty((0, 2)) if pixels is None else pixels.reshape(-1, 2)

    serve("OpenCV thinning", f"mean of {SIZE} + {OFFSET} levels, Zhang-Suen" + ", lit tiles" * tiles, centres)


main()
