"""One shard, run by the program. It needs the standard library only: Ray sends it to nodes without the package."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Callable
from typing import Any, NamedTuple


class Went(NamedTuple):
    """How a run of the program went."""

    #: Its exit code; negative: the signal that ended it.
    code: int
    #: What it printed of recordings, a dictionary each.
    lines: list[dict[str, Any]]
    #: The error that it ended with: kind, what, cause, next; None where it reported none.
    error: dict[str, str] | None


def run(command: list[str], heard: Callable[[dict[str, Any]], None] | None = None) -> Went:
    """Runs the program to its end; `heard` gets every line as it comes."""
    lines: list[dict[str, Any]] = []
    error: dict[str, str] | None = None
    with tempfile.TemporaryFile() as said:
        # When this process dies, the program finds its standard output closed and ends after its recording.
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, stdin=subprocess.DEVNULL) as program:
            assert program.stdout is not None
            for text in program.stdout:
                try:
                    line = json.loads(text)
                except ValueError:
                    # The program was killed within a line.
                    continue
                if "error" in line:
                    error = line["error"]
                    continue
                lines.append(line)
                if heard is not None:
                    heard(line)
        code = program.returncode
        if error is None and code != 0:
            said.seek(0)
            words = said.read()[-2000:].decode(errors="replace").strip()
            error = {"kind": "usage" if code == 2 else "lost", "what": words or f"ended with code {code}"}
    return Went(code, lines, error)
