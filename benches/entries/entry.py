"""In: pictures on standard input. Out: points on standard output, by a function from a picture to its (u, v).
The format is that of docs/benchmark.md. Unit: px; X, Y, Z in mm, camera frame.
"""
import json
import sys

import cv2
import numpy as np


def serve(name, settings, centres):
    """Answers a driver. `centres(picture)` returns an array of n rows of u, v, or of u, v and sigma, px."""
    source, sink = sys.stdin.buffer, sys.stdout.buffer
    header = json.loads(source.readline())
    width, height = header["width"], header["height"]
    pixel = np.dtype(np.uint8 if header["bits"] == 8 else "<u2")
    camera, plane = header["camera"], header["plane"]
    matrix = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]])
    lens, normal = np.array(camera["distortion"]), np.array(plane["normal"])
    # Methods for 8 bits get the upper ones.
    shift = header["bits"] - 8
    centres(np.zeros((height, width), np.uint8))
    sink.write(json.dumps({"name": name, "version": cv2.__version__, "settings": settings}).encode() + b"\n")
    sink.flush()
    while number := source.read(4):
        picture = np.frombuffer(source.read(width * height * pixel.itemsize), pixel).reshape(height, width)
        if shift:
            picture = (picture >> shift).astype(np.uint8)
        found = np.asarray(centres(picture), float)
        points = np.full((len(found), 6), np.nan, "<f4")
        if len(found):
            points[:, : found.shape[1]] = found
            ideal = cv2.undistortPoints(found[:, :2].reshape(-1, 1, 2), matrix, lens).reshape(-1, 2)
            rays = np.column_stack([ideal, np.ones(len(ideal))])
            points[:, 3:] = rays * (plane["offset_mm"] / (rays @ normal))[:, None]
        sink.write(number + np.uint32(len(points)).astype("<u4").tobytes() + points.tobytes())
        sink.flush()
