"""Workers: what runs a shard, and what it does when it is lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from .shard import Went, run


class Lost(Exception):
    """A worker went away with the shard that it had."""


class Worker(Protocol):
    """Runs one shard at a time."""

    #: For messages.
    name: str

    def run(self, command: list[str], heard: Callable[[dict[str, Any]], None]) -> Went:
        """Runs the program; raises Lost where the worker itself is gone. The next call finds a new one in its place."""
        ...

    def close(self) -> None:
        """Ends it."""
        ...


class Local:
    """A process of this machine for each shard."""

    def __init__(self, number: int) -> None:
        self.name = f"worker {number} of this machine"

    def run(self, command: list[str], heard: Callable[[dict[str, Any]], None]) -> Went:
        """Runs the program here; one that a signal ended counts as lost."""
        went = run(command, heard)
        if went.code < 0:
            raise Lost(f"its process was ended by signal {-went.code}")
        return went

    def close(self) -> None:
        """Nothing is left of it between shards."""
