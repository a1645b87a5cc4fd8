"""Files of a scan, read again by programs that share no code with what wrote them."""

from __future__ import annotations

import dataclasses
import importlib
import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import needs

import sheetlight
from sheetlight import SheetlightError

ENDINGS = ["ply", "pcd", "tif", "e57", "las", "laz", "parquet"]
#: What writes them.
PACKAGES = {"tif": "tifffile", "e57": "pye57", "las": "laspy", "laz": "lazrs", "parquet": "pyarrow"}


@dataclasses.dataclass
class Like:
    """What the writers ask of a scan, with other points or another report."""

    points: np.ndarray
    report: dict
    frame: str
    camera_places: list


def like(scan, **other) -> Like:
    return Like(**{"points": scan.points, "report": scan.report, "frame": scan.frame,
                   "camera_places": scan.camera_places, **other})  # fmt: skip


@pytest.fixture(scope="module")
def organised(scanned):
    return sheetlight.organise(scanned)


def by_hand(points: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """The number of the point in every cell, -1 where none is: one point after the other."""
    grid = np.full((rows, columns), -1)
    for i, p in enumerate(points):
        j = round(float(p["u"]))
        other = grid[p["shot"], j]
        if other < 0 or (p["quality"], -p["sigma"]) > (points[other]["quality"], -points[other]["sigma"]):
            grid[p["shot"], j] = i
    return grid


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b, equal_nan=True)


def test_rows_are_shots_and_columns_pixels(scanned, organised):
    points, grid = scanned.points, organised.points
    assert grid.dtype == sheetlight.POINT and grid.shape == (120, 640)
    assert organised.along == "u" and organised.frame == "base"
    expected = by_hand(points, *grid.shape)
    assert (organised.measured == (expected >= 0)).all()
    for name in sheetlight.POINT.names:
        assert (grid[name][organised.measured] == points[name][expected[expected >= 0]]).all(), name
        missing = grid[name][~organised.measured]
        assert np.isnan(missing).all() or name == "shot"
    assert (grid["shot"] == np.arange(120)[:, None]).all()
    assert organised.left_out == len(points) - organised.measured.sum() > 0


def test_an_upright_stripe_runs_along_the_rows_of_the_picture(scanned):
    turned = scanned.points.copy()
    turned["u"], turned["v"] = scanned.points["v"], scanned.points["u"]
    image = {"width": 480, "height": 640, "bits": 8}
    upright = sheetlight.organise(like(scanned, points=turned, report={**scanned.report, "image": image}))
    assert upright.along == "v" and upright.points.shape == (120, 640)
    assert (upright.measured == sheetlight.organise(scanned).measured).all()
    assert sheetlight.organise(scanned, along="v").points.shape == (120, 480)


def test_dark_shots_have_rows(scanned):
    points = scanned.points
    some = points[(points["shot"] >= 10) & (points["shot"] < 100)]
    measured = sheetlight.organise(scanned, points=some).measured
    assert measured.shape == (120, 640)
    assert not measured[:10].any() and not measured[100:].any() and measured[10:100].any(axis=1).all()


def vertices(file) -> tuple[str, np.ndarray]:
    """Header and vertices of a binary PLY."""
    header, _, body = file.read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    kinds = {"float": "<f4", "int": "<i4"}
    fields = [(name, kinds[kind]) for word, kind, name in (x.split() for x in lines if x.startswith("property"))]
    return header.decode("ascii"), np.frombuffer(body, fields)


def test_ply(scanned, organised, tmp_path):
    saved = sheetlight.save(scanned, tmp_path / "cloud.ply")
    assert saved == (tmp_path / "cloud.ply", organised.measured.sum(), organised.left_out, ())
    header, read = vertices(saved.path)
    assert "base frame, mm" in header and "obj_info num_cols 640\nobj_info num_rows 120\n" in header
    assert "element vertex 76800\n" in header and "row = shot, column = pixel along the stripe (u" in header
    for field, name in zip(sheetlight.POINT.names, read.dtype.names):
        assert name == {"sigma": "sigma_mm"}.get(field, field)
        wanted = organised.points[field]
        # Open3D's tensor reader knows no uint.
        wanted = wanted.astype("<i4") if field == "shot" else wanted
        assert same_bits(read[name].reshape(120, 640), wanted), name


def test_ply_as_trimesh_reads_it(scanned, organised, tmp_path):
    trimesh = needs("trimesh")
    sheetlight.save(scanned, tmp_path / "cloud.ply")
    read = np.asarray(trimesh.load(tmp_path / "cloud.ply", process=False).vertices).reshape(120, 640, 3)
    assert np.array_equal(read, sheetlight.xyz(organised.points), equal_nan=True)


def test_ply_and_pcd_as_open3d_reads_them(scanned, organised, tmp_path):
    open3d = needs("open3d", heavy=True)
    for ending in ("ply", "pcd"):
        sheetlight.save(scanned, tmp_path / f"cloud.{ending}")
        read = open3d.t.io.read_point_cloud(str(tmp_path / f"cloud.{ending}"))
        places = read.point.positions.numpy().astype(np.float64)
        # Its reader leaves out what was not measured, or keeps the cells.
        if len(places) == organised.points.size:
            places = places[np.isfinite(places[:, 0])]
        assert np.array_equal(places, sheetlight.xyz(organised.points[organised.measured])), ending


def test_pcd(scanned, organised, tmp_path):
    pypcd4 = needs("pypcd4")
    saved = sheetlight.save(scanned, tmp_path / "cloud.pcd")
    read = pypcd4.PointCloud.from_path(saved.path)
    meta = read.metadata
    assert (meta.width, meta.height, meta.points) == (640, 120, 76800) and saved.lost == ()
    for field, name in zip(sheetlight.POINT.names, meta.fields):
        assert name == {"sigma": "sigma_mm"}.get(field, field)
        assert same_bits(read.pc_data[name].reshape(120, 640), organised.points[field]), name
    assert b"base frame, mm" in saved.path.read_bytes()[:400]


def test_tiff(scanned, organised, tmp_path):
    needs("tifffile")
    image = needs("PIL.Image")
    saved = sheetlight.save(scanned, tmp_path / "cloud.tif")
    assert saved.lost == ("sigma", "intensity", "quality", "u", "v")
    with image.open(saved.path) as pages:
        assert pages.n_frames == 3
        for i, axis in enumerate("xyz"):
            pages.seek(i)
            assert pages.mode == "F" and pages.size == (640, 120)
            assert same_bits(np.asarray(pages), organised.points[axis]), axis
            assert pages.tag_v2[270].startswith(f"{axis}, mm, base frame; row = shot")


def test_e57(scanned, organised, tmp_path):
    pye57 = needs("pye57")
    saved = sheetlight.save(scanned, tmp_path / "cloud.e57")
    points = scanned.points
    assert saved[1:] == (len(points), 0, ("sigma", "quality", "u", "v"))
    with pye57.E57(str(saved.path)) as file:
        assert file.scan_count == 1
        header = file.get_header(0)
        read = file.read_scan(0, intensity=True, row_column=True, ignore_missing_fields=True)
        assert header["name"].value().endswith("base frame, metres")
    for axis in "xyz":
        # float32 in metres: half of its last digit.
        true = points[axis].astype(np.float64) / 1000
        far = np.abs(read[f"cartesian{axis.upper()}"] - true)
        assert (far <= np.spacing(np.abs(true).astype(np.float32))).all(), axis
    assert (read["intensity"] == points["intensity"]).all()
    assert (read["rowIndex"] == points["shot"]).all()
    assert (read["columnIndex"] == np.rint(points[organised.along])).all()


@pytest.mark.parametrize("ending", ["las", "laz"])
def test_las(scanned, tmp_path, ending):
    laspy = needs("laspy")
    needs("lazrs")
    saved = sheetlight.save(scanned, tmp_path / f"cloud.{ending}")
    points = scanned.points
    assert saved[1:] == (len(points), 0, ())
    read = laspy.read(saved.path)
    assert str(read.header.version) == "1.4" and read.header.point_format.id == 6
    assert saved.path.stat().st_size < 40 * len(points) or ending == "las"
    places = np.stack([read.x, read.y, read.z], axis=-1) * 1000
    # Steps of 10 nm.
    assert np.abs(places - sheetlight.xyz(points)).max() <= 0.5e-5 * 1.001
    for name, field in {"sigma_mm": "sigma", "level": "intensity", "quality": "quality", "shot": "shot", "u": "u",
                        "v": "v"}.items():  # fmt: skip
        assert (np.asarray(read[name]) == points[field]).all(), name
    assert np.abs(np.asarray(read.intensity) / 65535 * 255 - points["intensity"].clip(0, 255)).max() < 0.002
    system = next(v for v in read.header.vlrs if v.record_id == 2112)
    text = system.string if hasattr(system, "string") else system.record_data.decode()
    assert text.startswith('LOCAL_CS["base frame"') and 'UNIT["metre",1]' in text
    assert read.header.global_encoding.wkt


def test_las_of_a_large_cloud(scanned, tmp_path):
    laspy = needs("laspy")
    far = scanned.points.copy()
    far["x"] = np.linspace(-50_000, 150_000, len(far))
    read = laspy.read(sheetlight.save(like(scanned, points=far), tmp_path / "cloud.las").path)
    assert (read.header.scales == 1e-7).all()
    assert np.abs(np.asarray(read.x) * 1000 - far["x"]).max() <= 0.5e-4 * 1.001


def test_parquet(scanned, tmp_path):
    parquet = needs("pyarrow.parquet")
    saved = sheetlight.save(scanned, tmp_path / "cloud.parquet")
    read = parquet.read_table(saved.path)
    for field, name in zip(sheetlight.POINT.names, read.schema.names):
        assert name == {"sigma": "sigma_mm"}.get(field, field)
        assert same_bits(read.column(name).to_numpy(), np.ascontiguousarray(scanned.points[field])), name
    about = json.loads(read.schema.metadata[b"sheetlight"])
    assert about["units"] == "mm" and about["frame"] == "base" and about["program"].startswith("sheetlight ")
    assert read.schema.field("u").metadata[b"unit"] == b"px"


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_name_that_is_taken_is_refused(scanned, tmp_path, ending):
    needs(PACKAGES.get(ending, "numpy"))
    file = tmp_path / f"cloud.{ending}"
    file.write_text("mine")
    with pytest.raises(SheetlightError, match="there already.*\n.*\n.*overwrite=True"):
        sheetlight.save(scanned, file)
    assert file.read_text() == "mine"
    sheetlight.save(scanned, file, overwrite=True)
    assert file.stat().st_size > 100_000 and list(tmp_path.iterdir()) == [file]


def test_a_name_that_is_taken_meanwhile_is_refused(scanned, tmp_path, monkeypatch):
    from sheetlight._files import ply

    file = tmp_path / "cloud.ply"

    def slow(part, organised, about):
        part.write_text("ours")
        file.write_text("mine")

    monkeypatch.setattr(ply, "write", slow)
    with pytest.raises(SheetlightError, match="there already"):
        sheetlight.save(scanned, file)
    assert file.read_text() == "mine" and list(tmp_path.iterdir()) == [file]


FULL = """
import resource, signal, sys, sheetlight
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
scan = sheetlight.Scan.open(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    sheetlight.save(scan, sys.argv[2], overwrite=True)
except sheetlight.SheetlightError as error:
    print("refused:", error)
"""


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_full_disk_leaves_nothing_half_written(by_program, tmp_path, ending):
    needs(PACKAGES.get(ending, "numpy"))
    file = tmp_path / f"cloud.{ending}"
    file.write_text("former")
    command = [sys.executable, "-c", FULL, by_program, file]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert "refused:" in done.stdout and "disk is full" in done.stdout, done.stdout + done.stderr
    assert file.read_text() == "former" and list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("ending", sorted(PACKAGES))
def test_a_missing_package_says_how_to_install_it(scanned, tmp_path, monkeypatch, ending):
    needs("laspy")
    monkeypatch.setitem(sys.modules, PACKAGES[ending], None)
    with pytest.raises(SheetlightError) as raised:
        sheetlight.save(scanned, tmp_path / f"cloud.{ending}")
    error = raised.value
    assert PACKAGES[ending] in error.what and "extra 'files'" in error.cause
    assert "pip install 'sheetlight[files]'" in error.next and isinstance(error.__cause__, ImportError)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_saved_is_refused(scanned, tmp_path):
    points = scanned.points
    spoilt = points.copy()
    spoilt["y"][7] = np.nan
    wrong = [
        (points[:0], "no points"),
        (sheetlight.xyz(points), "float64"),
        (points.reshape(1, -1), "sheetlight.POINT"),
        (list(points[:3]), "list"),
        (spoilt, "1 of .* not finite"),
    ]
    for bad, words in wrong:
        with pytest.raises(SheetlightError, match=words) as raised:
            sheetlight.save(scanned, tmp_path / "cloud.ply", points=bad)
        assert raised.value.next
    for path, words in [("cloud.stl", r"\.stl.*\n.*\n.*\.laz"), ("cloud", "ends in ''"), (5, "int")]:
        with pytest.raises(SheetlightError, match=words):
            sheetlight.save(scanned, tmp_path / path if isinstance(path, str) else path)
    with pytest.raises(SheetlightError, match="cannot be written"):
        sheetlight.save(scanned, tmp_path / "none/cloud.ply")
    with pytest.raises(SheetlightError, match="along is 'w'"):
        sheetlight.organise(scanned, along="w")
    with pytest.raises(SheetlightError, match="no shots"):
        sheetlight.organise(like(scanned, camera_places=[]))
    assert list(tmp_path.iterdir()) == []


def test_some_points_of_other_layouts_are_taken(scanned, tmp_path):
    """A part of them, a view backwards, read-only: what numpy has numbers for."""
    needs("pyarrow")
    parquet = importlib.import_module("pyarrow.parquet")
    for i, some in enumerate([scanned.points[::3], scanned.points[::-1], scanned.points[scanned.points["shot"] == 5]]):
        for ending in ("parquet", "las", "e57", "ply"):
            needs(PACKAGES.get(ending, "numpy"))
            saved = sheetlight.save(scanned, tmp_path / f"{i}.{ending}", points=some)
            assert saved.points + saved.left_out == len(some)
        read = parquet.read_table(tmp_path / f"{i}.parquet")
        assert (read.column("x").to_numpy() == some["x"]).all()


def test_more_shots_than_an_e57_file_numbers(scanned, tmp_path):
    needs("pye57")
    late = scanned.points.copy()
    late["shot"] += 65_500
    image = {"width": 640, "height": 1, "bits": 8}
    scan = like(scanned, points=late[-400:], report={**scanned.report, "image": image})
    with pytest.raises(SheetlightError, match="of shot 65619, .* to shot 65535"):
        sheetlight.save(scan, tmp_path / "cloud.e57")
    assert list(tmp_path.iterdir()) == []
