"""Hands the shards of a batch to workers, and merges the tables when all are done."""

from __future__ import annotations

import queue
import sys
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .._error import SheetlightError
from .shard import Went, run as run_program
from .workers import Lost, Worker

#: Shards a worker, so that one that is slow or lost leaves little to the others.
SHARES = 8
#: Recordings of a shard at most: their lines come back together.
MOST_OF_A_SHARD = 1000
#: Times that a shard may lose its worker.
MOST_LOSSES = 5


class WrongUse(SheetlightError):
    """The command or its options make no sense."""


@dataclass(frozen=True)
class Batch:
    """What is run: the program's path and the words that follow `batch`, without a shard."""

    program: str
    words: Sequence[str]
    out: str

    def command(self, *more: str) -> list[str]:
        """The program's words with these behind them."""
        return [self.program, "batch", *self.words, *more, "--json", "--quiet"]


@dataclass
class Ended:
    """What came of a batch."""

    #: Recordings by state: done, refused, failed.
    states: Counter[str] = field(default_factory=Counter)
    #: Workers that were lost or retired, with the reason.
    losses: list[str] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether every recording came to what was wanted."""
        return not (self.states["refused"] or self.states["failed"])


class _Shards:
    """The shards that are open, and how they end."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.open: queue.SimpleQueue[int] = queue.SimpleQueue()
        for number in range(1, count + 1):
            self.open.put(number)
        self.left = count
        self.losses: Counter[int] = Counter()
        self.fault: SheetlightError | None = None
        self.changed = threading.Condition()

    def take(self) -> int | None:
        """An open shard; None when all are done, or when one cannot be. Waits while others may give theirs back."""
        with self.changed:
            while self.left and self.fault is None:
                try:
                    return self.open.get_nowait()
                except queue.Empty:
                    self.changed.wait()
            return None

    def done(self) -> None:
        with self.changed:
            self.left -= 1
            self.changed.notify_all()

    def back(self, number: int, why: str) -> None:
        """Gives it to the next worker that is free."""
        with self.changed:
            self.losses[number] += 1
            if self.losses[number] > MOST_LOSSES:
                self.fault = self.fault or SheetlightError(
                    f"shard {number}/{self.count} lost its worker {self.losses[number]} times, "
                    f"{MOST_LOSSES} are tried: {why}",
                    "one of its recordings takes more memory than a worker has, or machines are being taken away",
                    f"run sheetlight batch --shard {number}/{self.count} by itself and look at what it reports",
                )
            self.open.put(number)
            self.changed.notify_all()

    def fail(self, fault: SheetlightError) -> None:
        with self.changed:
            self.fault = self.fault or fault
            self.changed.notify_all()


def run(
    batch: Batch,
    workers: Sequence[Worker],
    shards: int | None = None,
    heard: Callable[[dict[str, Any]], None] = lambda line: None,
    say: Callable[[str], None] = lambda text: print(text, file=sys.stderr, flush=True),
) -> Ended:
    """Runs a batch to its tables. `heard` gets a dictionary for each recording, `say` what happens to workers.

    A shard is with one worker at a time, and a worker has one shard: what a worker has not asked for waits here.
    """
    planned = run_program(batch.command("--plan"))
    if planned.code != 0:
        raise _fault(planned)
    recordings = planned.lines[-1]["recordings"]
    count = shards or max(SHARES * len(workers), -(-recordings // MOST_OF_A_SHARD))
    open_shards, ended, lock = _Shards(min(count, recordings)), Ended(), threading.Lock()

    def drive(worker: Worker) -> None:
        try:
            while (number := open_shards.take()) is not None:
                if not _one(batch, worker, number, recordings, open_shards, ended, lock, heard, say):
                    break
        except SheetlightError as fault:
            open_shards.fail(fault)
        except BaseException as error:
            open_shards.fail(SheetlightError(f"{worker.name}: {error!r}", "a fault of the driver", "report it"))
            raise
        finally:
            worker.close()

    threads = [threading.Thread(target=drive, args=(w,), name=w.name, daemon=True) for w in workers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if open_shards.fault is not None:
        raise open_shards.fault
    if open_shards.left:
        raise SheetlightError(
            f"{open_shards.left} of {open_shards.count} shards are not done: all of {len(workers)} workers were "
            f"retired; the last: {ended.losses[-1]}",
            "what retired them stands in the lines before",
            "remove that cause, then run the same command: recordings with results are not scanned again",
        )
    merged = run_program([batch.program, "batch", "merge", batch.out, "--json", "--quiet"])
    if merged.code != 0 and not merged.lines:
        raise _fault(merged)
    return ended


def _one(
    batch: Batch,
    worker: Worker,
    number: int,
    recordings: int,
    shards: _Shards,
    ended: Ended,
    lock: threading.Lock,
    heard: Callable[[dict[str, Any]], None],
    say: Callable[[str], None],
) -> bool:
    """Runs one shard. False where the worker is of no further use."""
    place = f"shard {number}/{shards.count}"
    lines: list[dict[str, Any]] = []
    try:
        went = worker.run(batch.command("--shard", f"{number}/{shards.count}"), lines.append)
    except Lost as lost:
        ended.losses.append(f"{worker.name} with {place}: {lost}")
        say(f"warning: {worker.name} was lost with {place}; the shard goes to the next one that is free: {lost}")
        shards.back(number, str(lost))
        return True
    kind = (went.error or {}).get("kind")
    whole = len(lines) == -(-(recordings - number + 1) // shards.count)
    if kind == "usage" or (kind == "input" and not whole):
        raise _fault(went)
    if not whole:
        ended.losses.append(f"{worker.name} with {place}: {(went.error or {}).get('what')}")
        say(f"warning: {worker.name} is retired; {place} goes to another one: {_fault(went)}")
        shards.back(number, str(went.error))
        return False
    with lock:
        for line in lines:
            ended.states[line["state"]] += 1
            heard(line)
    shards.done()
    return True


def _fault(went: Went) -> SheetlightError:
    error = went.error or {}
    kind = WrongUse if went.code == 2 else SheetlightError
    return kind(error.get("what", f"code {went.code}"), error.get("cause", ""), error.get("next", ""))
