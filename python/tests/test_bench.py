"""Entries in Python for `sheetlight bench run`: the one that docs/benchmark.md shows, and those of benches/entries."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys

import pytest
from conftest import ROOT, needs


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """The rows of a run by scene, bits and entry."""
    program = os.environ.get("SHEETLIGHT_PROGRAM")
    if program is None:
        pytest.skip("SHEETLIGHT_PROGRAM names no program")
    needs("cv2")
    folder = tmp_path_factory.mktemp("bench")
    text = (ROOT / "docs/benchmark.md").read_text()
    shown = re.search(r"```python\n(.*?)```", text, re.S).group(1)
    assert len(shown.splitlines()) <= 40, "the document says 40 lines"
    (folder / "shown.py").write_text(shown)
    python, entries = shlex.quote(sys.executable), ROOT / "benches/entries"
    commands = {
        "shown": f"{python} shown.py",
        "opencv": f"{python} {shlex.quote(str(entries / 'opencv.py'))}",
        "tiles": f"{python} {shlex.quote(str(entries / 'opencv.py'))} --tiles",
        "ours": f"{shlex.quote(program)} bench entry --on cpu",
    }
    words = ["bench", "run", "--out", folder / "r.json", "--rounds", 1, "--seconds", 0.05, "--size", "640x480"]
    for scene in ["clean", "slanted", "dark"]:
        words += ["--scene", scene]
    words += ["--bits", 8, "--bits", 12, "--scenario", "offline"]
    for name, command in commands.items():
        words += ["--entry", f"{name}={command}"]
    subprocess.run([program, *map(str, words)], check=True, capture_output=True, cwd=folder)
    found = json.loads((folder / "r.json").read_text())["rows"]
    return {(r["task"]["scene"], r["task"]["bits"], r["entry"]): r for r in found}


@pytest.mark.parametrize("entry", ["shown", "opencv", "tiles", "ours"])
def test_an_entry_is_scored_at_both_depths(rows, entry):
    # A centroid or a fit finds the line far below a pixel; a skeleton's pixels and spurs are just good enough to count.
    limit = 0.5 if entry in ("opencv", "tiles") else 0.08
    for bits in (8, 12):
        row = rows["clean", bits, entry]
        assert row["failed"] is None, row
        accuracy = row["accuracy"]
        assert accuracy["rms_px"] < limit and accuracy["found"] > 0.9, accuracy
        # 0.3 mm a pixel at the depths of the scene.
        assert accuracy["rms_mm"] < 1.0 * limit, accuracy
        stated = accuracy["beyond_three_sigma"]
        assert (stated is None) == (entry != "ours"), accuracy
        assert rows["dark", bits, entry]["accuracy"]["found"] is None


def test_thinning_by_tiles_gives_the_same_points(rows):
    for bits in (8, 12):
        whole, tiles = (rows["clean", bits, entry]["accuracy"] for entry in ("opencv", "tiles"))
        numbers = [key for key, value in whole.items() if value is not None]
        assert len(numbers) >= 6
        # Pictures come in another order, so sums differ in their last digits.
        assert [tiles[key] for key in numbers] == pytest.approx([whole[key] for key in numbers], rel=1e-9)


def test_all_entries_saw_the_same_pictures(rows):
    for scene in ("clean", "slanted", "dark"):
        hashes = {r["pictures_sha256"] for (s, bits, _), r in rows.items() if (s, bits) == (scene, 8)}
        assert len(hashes) == 1
