"""Files that are complete or absent."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .._error import SheetlightError


@contextmanager
def aside(path: Path, overwrite: bool) -> Iterator[Path]:
    """A place beside `path` for a file of its name. It becomes `path` when the block ends without an exception."""
    refuse_existing(path, overwrite)
    # A folder of its own, because some libraries take the format from the name's ending.
    folder = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        part = folder / path.name
        yield part
        with open(part, "rb+") as file:
            os.fsync(file.fileno())
        refuse_existing(path, overwrite)
        os.replace(part, path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Raises SheetlightError for a name that is taken."""
    if os.path.lexists(path) and not overwrite:
        raise SheetlightError(
            f"{path} is there already", "it was written before", "choose another name, or give overwrite=True"
        )
