"""Whatever is wrong with what is given: one exception, which says what to do."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import sheetlight
from sheetlight import SheetlightError


def refused(call, *words: str) -> SheetlightError:
    with pytest.raises(SheetlightError) as raised:
        call()
    error = raised.value
    assert error.what and error.next, error
    for word in words:
        assert word in str(error), error
    return error


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: p.astype(np.float32), ["float32", "uint8"]),
        (lambda p: np.where(p > 9, p, np.nan), ["float64", "NaN"]),
        (lambda p: p.astype(">u2"), [">u2", "byte order"]),
        (lambda p: p.astype(np.int64), ["int64"]),
        (lambda p: p.astype(np.uint16), ["bits is not given"]),
        (lambda p: np.stack([p] * 3, axis=-1), ["(480, 640, 3)".replace("(", "[").replace(")", "]")]),
        (lambda p: p.ravel(), ["[307200]"]),
        (lambda p: p[:, ::2], ["ascontiguousarray"]),
        (lambda p: p.T, ["ascontiguousarray"]),
        (lambda p: p[:0], ["[0, 640]"]),
        (lambda p: p[:100].copy(), ["640x100"]),
        (lambda p: p.tolist(), ["list"]),
        (lambda p: "picture.png", ["str"]),
        (lambda p: None, ["NoneType"]),
    ],
)
def test_pictures(arrays, station, make, words):
    pictures, poses = arrays
    bad = make(pictures[60])
    refused(lambda: sheetlight.picture_points(bad, station), *words)
    mixed = [*pictures[:3], bad, *pictures[4:6]]
    refused(lambda: sheetlight.scan(mixed, station, poses[:6]), "picture 3", *words)


def test_deep_pictures_need_their_depth(arrays, station):
    pictures, poses = arrays
    deep = pictures[:4].astype(np.uint16) * 16
    refused(lambda: sheetlight.scan(deep, station, poses[:4]), "bits=9 to 16")
    refused(lambda: sheetlight.scan(deep, station, poses[:4], bits=8), "bits is 8")
    refused(lambda: sheetlight.scan(deep, station, poses[:4], bits=10), "1023")
    refused(lambda: sheetlight.scan(pictures[:4], station, poses[:4], bits=12), "bits is 12")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: np.where(p == 1.0, np.nan, p), ["not finite"]),
        (lambda p: p.T, ["last row"]),
        (lambda p: p * 2, ["0 0 0"]),
        (lambda p: p[:3], ["(3, 4)".replace("(", "[").replace(")", "]"), "4 x 4"]),
        (lambda p: p[:3, :3], ["9 numbers"]),
        (lambda p: [1.0, 2.0, 3.0, 0.0, 0.0, 0.0], ["[6]"]),
        (lambda p: "home", ["str"]),
        (lambda p: (p[:3, :3], [1.0, 2.0]), ["[2]"]),
    ],
)
def test_poses(arrays, station, make, words):
    pictures, poses = arrays
    bad = [*poses[:2], make(poses[2])]
    refused(lambda: sheetlight.scan(pictures[:3], station, bad), "pose 2", *words)


def test_pictures_and_poses_go_together(arrays, station):
    pictures, poses = arrays
    refused(lambda: sheetlight.scan(pictures[:9], station, poses[:8]), "8 poses")
    refused(lambda: sheetlight.scan(pictures[:8], station, poses[:9]), "8 pictures and 9 poses")
    refused(lambda: sheetlight.scan(pictures[:8], station), "(picture, pose)")
    refused(lambda: sheetlight.scan([], station), "no picture")
    refused(lambda: sheetlight.scan(7, station), "int")
    refused(lambda: sheetlight.scan(pictures[:8], station, 7), "poses is a int")


def test_a_generator_that_raises_is_named_and_is_the_cause(recording, station, tmp_path):
    def some():
        yield recording[0]
        yield recording[1]
        raise OSError("the camera was unplugged")

    for out in (None, tmp_path / "scan"):
        error = refused(lambda: sheetlight.scan(some(), station, out=out), "picture 2", "unplugged")
        assert isinstance(error.__cause__, OSError)
    assert not (tmp_path / "scan/cloud.ply").exists()


def test_a_generator_may_be_interrupted(recording, station):
    def some():
        yield recording[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sheetlight.scan(some(), station)


def test_folders_and_words(station, recording, tmp_path):
    refused(lambda: sheetlight.Recording(tmp_path), "meta.json")
    refused(lambda: sheetlight.Station(tmp_path / "none"), "station.toml")
    refused(lambda: sheetlight.Scan.open(tmp_path))
    refused(lambda: sheetlight.scan(tmp_path, station), "meta.json")
    refused(lambda: sheetlight.scan(recording, 5), "int")
    refused(lambda: sheetlight.scan(recording, tmp_path), "hand-eye")
    refused(lambda: sheetlight.scan(recording, station, on="abacus"), "abacus", "auto, gpu, cpu")
    refused(lambda: sheetlight.scan(recording, station, bits=8), "poses or bits")
    refused(lambda: sheetlight.scan(recording, station, cell_mm=-1.0), "cell_mm")
    refused(lambda: sheetlight.scan(iter(recording), station, out=tmp_path / "x", resume=True), "resume")
    refused(lambda: sheetlight.scan(recording, station, ambient=np.zeros((4, 4), np.uint8)), "ambient")


def test_a_badly_filled_disk_is_no_half_a_scan(recording, station, tmp_path):
    (tmp_path / "file").write_text("no folder")
    refused(lambda: sheetlight.scan(recording, station, out=tmp_path / "file/scan"), "file")


def test_the_exception_travels():
    error = SheetlightError("what", "cause", "next")
    again = pickle.loads(pickle.dumps(error))
    assert (again.what, again.cause, again.next) == ("what", "cause", "next")
    assert str(error) == "what\n  likely cause: cause\n  next step: next"
