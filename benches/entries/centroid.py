"""The centre of the light around the brightest row of each column, row by row, compiled by numba."""
import numba
import numpy as np
from entry import serve

LEAST, REACH = 40, 8


@numba.njit(cache=True)
def centroid(picture, least, reach):
    height, width = picture.shape
    best = np.zeros(width, np.uint8)
    at = np.zeros(width, np.uint16)
    for y in range(height):
        row, here = picture[y], np.uint16(y)
        for x in range(width):
            at[x] = here if row[x] > best[x] else at[x]
            best[x] = max(row[x], best[x])
    out = np.empty((width, 2))
    n = 0
    for x in range(width):
        if best[x] < least:
            continue
        top, end = max(int(at[x]) - reach, 0), min(int(at[x]) + reach + 1, height)
        low = 255
        for y in range(top, end):
            low = min(low, int(picture[y, x]))
        light, moment = 0, 0
        for y in range(top, end):
            v = int(picture[y, x]) - low
            light += v
            moment += v * y
        if light > 0:
            out[n, 0], out[n, 1] = x, moment / light
            n += 1
    return out[:n]


serve("column centroid", f"{2 * REACH + 1} rows, at least {LEAST} levels, numba", lambda p: centroid(p, LEAST, REACH))
