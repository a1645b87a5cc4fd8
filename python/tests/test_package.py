"""The package as users meet it: quick to import, documented, typed, and the README's lines work."""

from __future__ import annotations

import importlib.util
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

import sheetlight


def test_it_is_imported_quickly():
    """At most 0.3 s beside numpy, which whoever has arrays has imported: the best of five on a busy machine."""
    code = "import time, numpy; t = time.perf_counter(); import sheetlight; print(time.perf_counter() - t)"
    run = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(5)]
    seconds = min(float(r.stdout) for r in run)
    print(f"import sheetlight: {seconds:.3f} s beside numpy")
    assert seconds < 0.3


def test_everything_says_what_it_is():
    for name in sheetlight.__all__:
        thing = getattr(sheetlight, name)
        if inspect.isclass(thing):
            public = [m for n, m in vars(thing).items() if not n.startswith("_")]
            described = [m for m in public if callable(m) or inspect.isdatadescriptor(m)]
            assert thing.__doc__, name
            assert all(inspect.getdoc(m) for m in described if not isinstance(m, str)), name
        elif callable(thing):
            assert thing.__doc__, name


@pytest.mark.parametrize("check", [["mypy.stubtest", "sheetlight"], ["mypy", "--strict", "-p", "sheetlight"]])
def test_the_types_are_those_of_the_code(check, tmp_path):
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is not installed")
    # stubtest sees a class within a method as one of the module, by its line.
    local = tmp_path / "local"
    local.write_text(r"sheetlight\.batch\.cluster\.Runner@\d+" + "\n")
    more = ["--cache-dir", str(tmp_path)] if check[0] == "mypy" else ["--allowlist", str(local)]
    command = [sys.executable, "-m", *check, *more]
    # Where the package is installed, whatever the folder of this test.
    place = str(Path(sheetlight.__file__).parents[1])
    env = {**os.environ, "MYPYPATH": place, "PYTHONPATH": place}
    done = subprocess.run(command, capture_output=True, text=True, env=env, cwd=place)
    assert done.returncode == 0, done.stdout + done.stderr


def test_optional_packages_are_extras_and_load_late():
    """The extras that errors name are there, and an import alone loads none of their packages."""
    text = (ROOT / "python/pyproject.toml").read_text().partition("[project.optional-dependencies]")[2]
    extras = set(re.findall(r"^(\w+) = \[", text.partition("\n[")[0], re.M))
    sources = [file.read_text() for file in (ROOT / "python/sheetlight").rglob("*.py")]
    named = {extra for source in sources for extra in re.findall(r'needed\([^()]*"(\w+)"\)', source)}
    assert named == extras == {"files", "convert", "open3d", "ray", "rerun"}
    heavy = ["laspy", "matplotlib", "open3d", "pyarrow", "pye57", "ray", "rerun", "tifffile", "trimesh", "xarray"]
    code = f"import sys, sheetlight; print([p for p in {heavy} if p in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_the_readmes_lines_work(monkeypatch, capsys):
    text = (ROOT / "README.md").read_text()
    lines = [b for b in re.findall(r"```python\n(.*?)```", text, re.S) if "import sheetlight" in b]
    assert len(lines) == 1 and len(lines[0].splitlines()) <= 12
    monkeypatch.chdir(ROOT)
    exec(compile(lines[0], "README.md", "exec"), {})
    said = capsys.readouterr().out
    assert "points from 200 shots" in said
