"""Packages that only some functions need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ._error import SheetlightError


def needed(name: str, purpose: str, extra: str) -> Any:
    """The module; raises SheetlightError where its package is not installed. `extra` is sheetlight's that has it."""
    try:
        return import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise SheetlightError(
            f"{purpose} needs the package {package}: {error}",
            f"sheetlight was installed without its extra '{extra}'",
            f"run pip install 'sheetlight[{extra}]'",
        ) from error
