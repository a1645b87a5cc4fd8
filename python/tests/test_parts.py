"""Parts in scans and in pictures, against what is true of them."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT

import sheetlight
from sheetlight import SheetlightError

RECIPE = ROOT / "data/recipes/led.toml"


def test_a_part_is_found_where_it_is(made, scanned, station, by_program):
    found = sheetlight.find(scanned, sheetlight.Recipe(RECIPE), station, notation="denso")
    true = next(p for p in made.truth()["parts"] if p["name"] == "led")
    off = found.base_from_part[:3, 3] - np.reshape(true["base_T_part"], (4, 4))[:3, 3]
    assert np.linalg.norm(off) < 0.2
    assert found.picture.ndim == 3 and found.picture.dtype == np.uint8 and len(found.sigma_mm) == 3
    assert found.passed == (found.insertion is not None) and found.passed == (not found.reasons)
    if found.passed:
        insertion = sheetlight.pose_from_numbers(found.numbers["insertion"], "denso")
        assert np.allclose(insertion, found.insertion, atol=1e-6)
    # The program's folder gives the same; its places of the camera went through a file, which costs their last digits.
    theirs = sheetlight.find(by_program, RECIPE, station)
    assert np.allclose(theirs.base_from_part, found.base_from_part, atol=1e-9)
    assert np.allclose(theirs.sigma_mm, found.sigma_mm, rtol=1e-9) and theirs.passed == found.passed


def test_what_is_not_there_is_not_found(made, scanned, station, tmp_path):
    text = RECIPE.read_text().replace("size = [30.48, 17.78]", "size = [75.0, 60.0]")
    with pytest.raises(SheetlightError):
        sheetlight.find(scanned, sheetlight.Recipe.parse(text), station)
    with pytest.raises(SheetlightError, match="recipe"):
        sheetlight.find(scanned, 5, station)
    with pytest.raises(SheetlightError):
        sheetlight.Recipe.parse("name = 5")
    other = sheetlight.simulate(tmp_path / "other", shots=2, seed=9).station
    with pytest.raises(SheetlightError, match="calibration"):
        sheetlight.find(scanned, RECIPE, other)


def test_a_taught_part_is_found_again(scanned, station):
    found = sheetlight.find(scanned, RECIPE, station)
    part = np.linalg.inv(scanned.map.base_from_grid) @ found.base_from_part
    # The map that teaching uses has its own corner, which is this scan's.
    (x, y), turn = part[:2, 3], np.degrees(np.arctan2(part[1, 0], part[0, 0]))
    outline = (x - 15.24, y - 8.89, x + 15.24, y + 8.89)
    recipe, proof = sheetlight.teach(scanned, "taught", outline, angle_deg=turn)
    assert recipe.name == "taught" and "rectangle" in recipe.text
    again = sheetlight.find(scanned, sheetlight.Recipe.parse(recipe.text), station)
    assert np.linalg.norm(again.base_from_part[:3, 3] - proof.base_from_part[:3, 3]) < 0.1
    with pytest.raises(SheetlightError, match="map"):
        sheetlight.teach(scanned, "far", (1e4, 1e4, 2e4, 2e4))


def shape(height: int, width: int, x: float, y: float) -> np.ndarray:
    """A bright L on grey, with edges a pixel wide."""
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))

    def step(v: np.ndarray) -> np.ndarray:
        return np.clip(v + 0.5, 0, 1)

    def bar(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
        return step(columns - x0) * step(x1 - columns) * step(rows - y0) * step(y1 - rows)

    light = np.maximum(bar(x, y, x + 12, y + 60), bar(x, y + 48, x + 44, y + 60))
    return np.round(40 + 160 * light).astype(np.uint8)


def test_a_template_is_matched_to_a_fraction_of_a_pixel():
    template = sheetlight.Template.teach("L", shape(120, 100, 25.0, 30.0), (10, 15, 80, 90))
    # The middle of the region is (49.5, 59.5); the L moved by (60.3, 20.7).
    picture = shape(300, 400, 85.3, 50.7)
    best = sheetlight.match_template(template, picture, angles_deg=(-5, 5))[0]
    assert abs(best["x_px"] - 109.8) < 0.1 and abs(best["y_px"] - 80.2) < 0.1
    assert abs(best["angle_deg"]) < 0.2 and best["score"] > 0.95 and best["correlation"] > 0.95
    assert sheetlight.match_template(template, np.full((300, 400), 40, np.uint8)) == []
    with pytest.raises(SheetlightError, match="min_score"):
        sheetlight.match_template(template, picture, min_score=7.0)
    with pytest.raises(SheetlightError):
        sheetlight.Template.teach("flat", np.full((90, 90), 40, np.uint8))


def test_templates_are_written_and_read(tmp_path):
    template = sheetlight.Template.teach("L", shape(120, 100, 25.0, 30.0))
    (tmp_path / "L.json").write_text(template.text)
    again = sheetlight.Template.load(tmp_path / "L.json")
    assert again.name == "L" and again.text == template.text
    (tmp_path / "L.json").write_text("{}")
    with pytest.raises(SheetlightError, match="L.json"):
        sheetlight.Template.load(tmp_path / "L.json")


def test_simulations_are_repeatable_and_temporary(tmp_path):
    first = sheetlight.simulate(shots=2, seed=5, size=(320, 240), noise=0.0)
    recording = first.recording()
    folder = first.folder
    again = sheetlight.simulate(tmp_path / "again", shots=2, seed=5, size=(320, 240), noise=0.0)
    assert (recording[0][0] == again.recording()[0][0]).all() and recording[0][0].shape == (240, 320)
    del first
    assert folder.exists() and len(recording) == 2
    del recording
    assert not folder.exists()
    with pytest.raises(SheetlightError, match="no set"):
        again.recording("handeye")
    with pytest.raises(SheetlightError, match="unknown set"):
        sheetlight.simulate(tmp_path / "x", sets=["cake"])
    with pytest.raises(SheetlightError, match="noise"):
        sheetlight.simulate(tmp_path / "x", noise=float("nan"))
