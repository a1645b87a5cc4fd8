"""Runs the notebooks of this folder, and writes the last figure of each as a picture.

    python python/notebooks/run.py [--pictures docs/images] [NAME ...]

A notebook runs in this folder, as Jupyter runs it. Its cells are plain Python.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import time
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
#: Dots an inch of the pictures.
DPI = 80


def notebooks() -> list[Path]:
    """The notebooks, by name."""
    return sorted(FOLDER.glob("*.ipynb"))


def cells(notebook: Path) -> list[str]:
    """The code of its cells."""
    read = json.loads(notebook.read_text())
    return ["".join(cell["source"]) for cell in read["cells"] if cell["cell_type"] == "code"]


def run(notebook: Path, picture: Path | None = None) -> dict[str, Any]:
    """Runs a notebook and gives the names that it leaves; with `picture` its last figure is written there."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    names: dict[str, Any] = {"__name__": "__main__"}
    before = os.getcwd()
    os.chdir(FOLDER)
    try:
        for i, code in enumerate(cells(notebook)):
            exec(compile(code, f"{notebook.name}, code cell {i}", "exec"), names)
        if picture is not None:
            write(pyplot.gcf(), picture)
    finally:
        os.chdir(before)
        pyplot.close("all")
    return names


def write(figure: Any, picture: Path) -> None:
    """A figure as a PNG of 128 colours, a third of the size of all colours."""
    from PIL import Image

    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=DPI)
    Image.open(drawn).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(picture, optimize=True)


def main() -> None:
    """Runs those that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of a notebook, without .ipynb")
    parser.add_argument("--pictures", type=Path, help="folder for notebook-NAME.png")
    options = parser.parse_args()
    for notebook in notebooks():
        if options.names and notebook.stem not in options.names:
            continue
        started = time.monotonic()
        picture = options.pictures and options.pictures.resolve() / f"notebook-{notebook.stem.replace('_', '-')}.png"
        print(f"--- {notebook.stem}")
        run(notebook, picture)
        print(f"--- {notebook.stem}: {time.monotonic() - started:.1f} s")


if __name__ == "__main__":
    main()
