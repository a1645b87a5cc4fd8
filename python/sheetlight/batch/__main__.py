"""The command line of sheetlight.batch."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from .._error import SheetlightError
from .driver import Batch, WrongUse, run
from .workers import Local, Worker


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sheetlight.batch",
        description="Runs `sheetlight batch` on several workers and merges the tables. Exit code 0: all done; 1: some "
        "recordings failed, or the run ended early; 2: wrong use. Run again, it goes on where it ended.",
    )
    parser.add_argument("manifest", help="list of recordings, made by sheetlight batch manifest")
    parser.add_argument("--station", required=True, help="station folder with the calibration")
    parser.add_argument("--out", required=True, help="folder for results and tables, the same for all workers")
    parser.add_argument("--recipe", help="recipe (TOML) of the part")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="change a setting")
    parser.add_argument("--skip-bad", action="store_true", help="exclude pictures that cannot be read")
    parser.add_argument("--on", default="auto", help="where the stages run: auto, gpu or cpu")
    parser.add_argument("--robot", help="notation of the poses")
    parser.add_argument("--workers", type=int, metavar="N", help="workers [default: with --ray one a device]")
    parser.add_argument("--ray", metavar="ADDRESS", help="a running Ray cluster: its address, or auto")
    parser.add_argument("--shards", type=int, metavar="N", help="shares of the manifest [default: 8 a worker]")
    parser.add_argument("--program", default="sheetlight", help="the program, on every node [default: sheetlight]")
    return parser


def _batch(given: argparse.Namespace) -> Batch:
    program = shutil.which(given.program)
    if program is None:
        raise WrongUse(
            f"{given.program}: there is no such program",
            "it is not installed, or not on the path",
            "install it with cargo install, or give its path with --program",
        )

    def whole(path: str) -> str:
        # Workers run in other folders.
        return str(Path(path).absolute())

    words = [whole(given.manifest), "--station", whole(given.station), "--out", whole(given.out), "--on", given.on]
    words += ["--recipe", whole(given.recipe)] if given.recipe else []
    words += ["--skip-bad"] if given.skip_bad else []
    words += ["--robot", given.robot] if given.robot else []
    words += [word for change in given.set for word in ("--set", change)]
    return Batch(program if given.ray is None else given.program, words, whole(given.out))


def _positive(given: argparse.Namespace) -> None:
    for name in ["workers", "shards"]:
        value = getattr(given, name)
        if value is not None and value < 1:
            raise WrongUse(f"--{name} is {value}, 1 or more needed", "a slip of the hand", f"give --{name} 1")
    if given.ray is None and given.workers is None:
        raise WrongUse(
            "0 workers are named, 1 or more needed", "neither --workers nor --ray was given", "give --workers 1"
        )
    if not Path(given.manifest).is_file():
        raise WrongUse(
            f"{given.manifest}: there is no such file",
            "the path is wrong, or the folder of the recordings was given",
            "make a manifest with sheetlight batch manifest FOLDER --out FILE",
        )


def _workers(given: argparse.Namespace) -> list[Worker]:
    if given.ray is None:
        return [Local(k) for k in range(1, given.workers + 1)]
    from . import cluster

    return list(cluster.actors(given.ray, given.workers))


def _lines_alone() -> TextIO:
    """Standard output for the recordings' lines. Ray talks there too, until its end: that goes to standard error."""
    sys.stdout.flush()
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return out


def _printer(out: TextIO) -> Callable[[dict[str, Any]], None]:
    return lambda line: print(json.dumps(line), file=out, flush=True)


def main(words: list[str] | None = None) -> int:
    """Runs the command line; returns the exit code."""
    given = _arguments().parse_args(words)
    try:
        _positive(given)
        printer = _printer(_lines_alone())
        ended = run(_batch(given), _workers(given), given.shards, printer)
    except SheetlightError as fault:
        print(f"error: {fault}", file=sys.stderr)
        return 2 if isinstance(fault, WrongUse) else 1
    done = ", ".join(f"{count} {state}" for state, count in sorted(ended.states.items()))
    print(f"{done}; {len(ended.losses)} workers lost; tables in {given.out}", file=sys.stderr)
    return 0 if ended.complete else 1


if __name__ == "__main__":
    sys.exit(main())
