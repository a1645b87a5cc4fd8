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
        (lambda p: p > 9, ["bool"]),
        (lambda p: p.astype(np.int8), ["int8"]),
        (lambda p: p.astype(complex), ["complex128"]),
        (lambda p: p.astype(object), ["object"]),
        (lambda p: np.ma.masked_greater(p, 200), ["MaskedArray", "masks"]),
        (lambda p: np.zeros((4, 4), [("grey", "u1")]), ["grey"]),
        (lambda p: p.astype(np.uint16), ["bits is not given"]),
        (lambda p: np.stack([p] * 3, axis=-1), ["(480, 640, 3)".replace("(", "[").replace(")", "]")]),
        (lambda p: p.ravel(), ["[307200]"]),
        (lambda p: p[:, ::2], ["ascontiguousarray"]),
        (lambda p: p.T, ["ascontiguousarray"]),
        (lambda p: np.asfortranarray(p), ["ascontiguousarray"]),
        (lambda p: p[::-1], ["[-640, 1]", "ascontiguousarray"]),
        (lambda p: np.broadcast_to(p[0], p.shape), ["[0, 1]", "ascontiguousarray"]),
        (lambda p: p[0, 0], ["uint8", "numpy array"]),
        (lambda p: np.array(7, np.uint8), ["[]"]),
        (lambda p: np.ascontiguousarray(p.T), ["480x640"]),
        (lambda p: np.zeros((1, 1), np.uint8), ["1x1"]),
        (lambda p: p[:0], ["[0, 640]"]),
        (lambda p: p[:100].copy(), ["640x100"]),
        (lambda p: p.tolist(), ["list"]),
        (lambda p: p.tobytes(), ["bytes"]),
        (lambda p: memoryview(p), ["memoryview"]),
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


def test_deep_pictures_of_another_byte_order(arrays, station):
    deep = arrays[0][60].astype(">u2")
    refused(lambda: sheetlight.picture_points(deep, station, bits=12), ">u2", "byte order")


def test_a_depth_that_changes_is_named(arrays, station):
    pictures, poses = arrays
    deep = [p.astype(np.uint16) for p in pictures[:6]]
    refused(lambda: sheetlight.scan([*pictures[:3], deep[3]], station, poses[:4]), "picture 3", "16 bits")
    refused(lambda: sheetlight.scan([*deep[:3], pictures[3]], station, poses[:4], bits=12), "picture 3", "8 bits")


def test_a_size_that_changes_is_named_and_never_skipped(arrays, station):
    pictures, poses = arrays

    def cut():
        for i, (picture, pose) in enumerate(zip(pictures[:8], poses)):
            yield (picture[:240].copy() if i == 5 else picture), pose

    for skip_bad in (False, True):
        refused(lambda: sheetlight.scan(cut(), station, skip_bad=skip_bad), "picture 5 is 640x240", "640x480")


def test_other_places_that_take_pictures(arrays, station):
    pictures, poses = arrays
    picture = pictures[60]
    live = sheetlight.Live(station, (640, 480), on="cpu")
    refused(lambda: live.measure(picture[:100].copy()), "640x100", "640x480")
    refused(lambda: live.measure(picture.astype(np.float64)), "float64")
    refused(lambda: live.measure(picture.astype(np.uint16)), "bits is not given")
    assert len(live.measure(picture)) > 100
    for bad, word in [(picture[:10].copy(), "640x10"), (picture / 2, "float64"), (picture.T, "strides")]:
        refused(lambda: sheetlight.scan(pictures[:4], station, poses[:4], ambient=bad), "ambient", word)
    refused(lambda: sheetlight.Template.teach("L", picture / 2), "float64")
    refused(lambda: sheetlight.scan(pictures[:4].astype(np.float32), station, poses[:4]), "picture 0", "float32")
    refused(lambda: sheetlight.scan(pictures[None, :4], station, poses[:4]), "picture 0", "[4, 480, 640]")


def same_points(a: sheetlight.Scan, b: sheetlight.Scan) -> bool:
    return len(a.points) > 1000 and a.points.tobytes() == b.points.tobytes()


@pytest.mark.parametrize(
    "make",
    [
        lambda p: p.astype(">f8"),
        lambda p: np.asfortranarray(p),
        lambda p: np.repeat(p, 2, axis=0)[::2],
        lambda p: p[::-1].copy()[::-1],
        lambda p: p.tolist(),
        lambda p: (matrix for matrix in p),
    ],
)
def test_poses_of_other_layouts_are_the_same_poses(arrays, station, make):
    pictures, poses = arrays[0][50:60], arrays[1][50:60]
    plain = sheetlight.scan(pictures, station, poses, on="cpu")
    assert same_points(sheetlight.scan(pictures, station, make(poses), on="cpu"), plain)


def test_every_second_picture_of_a_stack(arrays, station):
    """A stack may be a part of another one, as long as the rows of each picture follow each other."""
    pictures, poses = arrays[0][40:60:2], arrays[1][40:60:2]
    plain = sheetlight.scan(pictures.copy(), station, poses, on="cpu")
    assert same_points(sheetlight.scan(pictures, station, poses, on="cpu"), plain)


def test_a_buffer_that_is_filled_again(arrays, station):
    """A camera's driver gives the same memory for every picture."""
    pictures, poses = arrays[0][50:60], arrays[1][50:60]
    plain = sheetlight.scan(pictures, station, poses, on="cpu")

    def camera():
        buffer = np.empty_like(pictures[0])
        for picture, pose in zip(pictures, poses):
            buffer[:] = picture
            yield buffer, pose

    assert same_points(sheetlight.scan(camera(), station, on="cpu"), plain)


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


@pytest.mark.parametrize("at", [0, 3])
@pytest.mark.parametrize("error", [ValueError("torn"), MemoryError("full"), StopIteration(), Exception()])
def test_whatever_a_generator_raises_is_the_cause(recording, station, at, error):
    def some():
        for i in range(8):
            if i == at:
                raise error
            yield recording[i]

    for skip_bad in (False, True):
        said = refused(lambda: sheetlight.scan(some(), station, skip_bad=skip_bad), f"picture {at}")
        # Python makes a RuntimeError of a StopIteration within a generator.
        assert said.__cause__ is error or said.__cause__.__cause__ is error


def test_poses_that_end_are_not_real_or_look_like_metres(arrays, station):
    pictures, poses = arrays

    def some():
        yield poses[0]
        raise OSError("the controller was switched off")

    error = refused(lambda: sheetlight.scan(pictures[:8], station, some()), "pose 1", "switched off")
    assert isinstance(error.__cause__, OSError)
    refused(lambda: sheetlight.scan(pictures[:8], station, poses[:8] * 1j), "pose 0", "complex")
    refused(lambda: sheetlight.scan(pictures[:8], station, np.ma.masked_less(poses[:8], 0)), "pose 0", "masked")
    metres = poses[:8].copy()
    metres[:, :3, 3] /= 1000
    with pytest.warns(UserWarning, match="look like metres"):
        try:
            sheetlight.scan(pictures[:8], station, metres)
        except SheetlightError:
            pass


def test_an_exception_of_our_own_comes_through_as_it_is(recording, station):
    ours = SheetlightError("the camera is hot", "no fan", "wait")

    def some():
        yield recording[0]
        raise ours

    with pytest.raises(SheetlightError) as raised:
        sheetlight.scan(some(), station)
    assert raised.value is ours


def test_a_program_may_end_within_a_generator(recording, station):
    def some():
        yield recording[0]
        raise SystemExit(3)

    with pytest.raises(SystemExit):
        sheetlight.scan(some(), station)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda picture, pose: (picture, pose, 1), ["picture 0", "tuple", "(picture, pose)"]),
        (lambda picture, pose: (picture,), ["picture 0", "tuple"]),
        (lambda picture, pose: [picture, pose], ["picture 0", "list"]),
        (lambda picture, pose: (pose, picture), ["pose 0", "[480, 640]"]),
        (lambda picture, pose: (picture, None), ["pose 0"]),
        (lambda picture, pose: None, ["picture 0", "NoneType"]),
    ],
)
def test_what_is_no_pair(recording, station, make, words):
    refused(lambda: sheetlight.scan((make(*pair) for pair in recording), station), *words)


@pytest.mark.parametrize("points", [[1.0, 2.0, 3.0], [[1.0, 2.0]], [["a", "b", "c"]], [[1.0], [1.0, 2.0]], None])
def test_points_that_are_no_rows_of_three(made, station, points):
    refused(lambda: station.camera.value.project(points), "points")
    refused(lambda: made.distances(points), "points")


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
