"""Steger, "An Unbiased Detector of Curvilinear Structures" (1998): sub-pixel zeros of the derivative across the line."""
import cv2
import numba
import numpy as np
from entry import serve

SIGMA, LEAST = 2.5, 4.0


@numba.njit(cache=True)
def ridge(gx, gy, gxx, gxy, gyy, least):
    height, width = gx.shape
    out = np.empty((height * width // 8, 2))
    n = 0
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            a, b, c = gxx[y, x], gxy[y, x], gyy[y, x]
            d = 0.5 * (a - c)
            q = np.sqrt(d * d + b * b)
            low = 0.5 * (a + c) - q
            if low > -least:
                continue
            # Of the two forms of the eigenvector, the one that does not cancel.
            nx, ny = (b, low - a) if d > 0 else (low - c, b)
            length = np.sqrt(nx * nx + ny * ny)
            if length == 0:
                continue
            nx, ny = nx / length, ny / length
            t = -(gx[y, x] * nx + gy[y, x] * ny) / low
            if abs(t * nx) <= 0.5 and abs(t * ny) <= 0.5 and n < len(out):
                out[n, 0], out[n, 1] = x + t * nx, y + t * ny
                n += 1
    return out[:n]


def centres(picture):
    smooth = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), SIGMA)
    first = lambda dx, dy: cv2.Sobel(smooth, cv2.CV_32F, dx, dy, scale=1 / 8)
    second = lambda dx, dy: cv2.Sobel(smooth, cv2.CV_32F, dx, dy, scale=1 / 4)
    return ridge(first(1, 0), first(0, 1), second(2, 0), second(1, 1), second(0, 2), LEAST)


serve("Steger", f"sigma {SIGMA} px, second derivative at least {LEAST} levels a px²", centres)
