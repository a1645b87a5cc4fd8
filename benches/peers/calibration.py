"""In: the input of benches/calibration.rs. Out: OpenCV's times for it, in ms: CPU time of all threads and wall time.

Usage: SHEETLIGHT_REFERENCE=... python benches/peers/calibration.py   (needs opencv-python and numpy)
"""
import glob
import json
import os
import statistics
import time

import cv2
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def timed(name, work, runs):
    cpu, wall = [], []
    for _ in range(runs):
        start = time.process_time(), time.perf_counter()
        work()
        cpu.append(1000.0 * (time.process_time() - start[0]))
        wall.append(1000.0 * (time.perf_counter() - start[1]))
    print(f"{name}: CPU best {min(cpu):.2f} ms, median {statistics.median(cpu):.2f} ms; wall best {min(wall):.2f} ms")


def main():
    with open(os.path.join(HERE, "../../tests/data/opencv_corners.json")) as f:
        sets = json.load(f)["sets"]
    board = np.zeros((54, 3), np.float32)
    board[:, :2] = np.mgrid[0:9, 0:6].T.reshape(-1, 2)
    sides = {side: [np.array(c, np.float32).reshape(-1, 1, 2) for c in sets[side]["corners"]] for side in sets}

    def calibrate(corners):
        return cv2.calibrateCamera([board] * len(corners), corners, (640, 480), None, None)

    print(f"OpenCV {cv2.__version__}, {cv2.getNumThreads()} threads")
    timed("camera solve, 13 + 13 pictures, two cameras", lambda: [calibrate(c) for c in sides.values()], 20)
    timed("camera solve, 26 pictures, one camera", lambda: calibrate(sides["left"] + sides["right"]), 20)
    folder = os.environ.get("SHEETLIGHT_REFERENCE")
    if not folder:
        print("SKIPPED: detection needs SHEETLIGHT_REFERENCE")
        return
    names = sorted(glob.glob(os.path.join(folder, "camera/opencv_chessboard/*.jpg")))
    pictures = [cv2.imread(n, cv2.IMREAD_GRAYSCALE) for n in names]
    plain = lambda: [cv2.findChessboardCornersSB(p, (9, 6)) for p in pictures]
    print("found by findChessboardCornersSB:", sum(r[0] for r in plain()), "of", len(pictures))
    timed(f"board detection, {len(pictures)} photographs", plain, 5)
    sharp = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE
    timed("the same, accurate and exhaustive", lambda: [cv2.findChessboardCornersSB(p, (9, 6), sharp) for p in pictures], 3)


if __name__ == "__main__":
    main()
