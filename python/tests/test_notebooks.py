"""The notebooks run from top to bottom, and hold no outputs in the repository."""

from __future__ import annotations

import importlib.util
import json

import pytest
from conftest import ROOT, needs

spec = importlib.util.spec_from_file_location("run", ROOT / "python/notebooks/run.py")
run = importlib.util.module_from_spec(spec)
spec.loader.exec_module(run)

NEEDED = {"opencv_to_open3d": ["cv2"], "calibrate_beside_opencv": ["cv2"]}


def test_there_are_notebooks():
    assert len(run.notebooks()) == 5


@pytest.mark.parametrize("notebook", run.notebooks(), ids=lambda n: n.stem)
def test_outputs_are_stripped_and_cells_are_plain(notebook):
    read = json.loads(notebook.read_text())
    assert read["nbformat"] == 4 and read["metadata"]["kernelspec"]["name"] == "python3"
    assert len({cell["id"] for cell in read["cells"]}) == len(read["cells"])
    for cell in read["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
        assert all(len(line.rstrip("\n")) <= 120 for line in cell["source"])
    assert read["cells"][0]["cell_type"] == "markdown"
    picture = f"notebook-{notebook.stem.replace('_', '-')}.png"
    assert (ROOT / "docs/images" / picture).exists()
    assert f"images/{picture}" in (ROOT / "docs/python.md").read_text()


@pytest.mark.parametrize("notebook", run.notebooks(), ids=lambda n: n.stem)
def test_a_notebook_runs(notebook, tmp_path):
    for package in ["matplotlib", *NEEDED.get(notebook.stem, [])]:
        needs(package)
    picture = tmp_path / "figure.png"
    run.run(notebook, picture)
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
