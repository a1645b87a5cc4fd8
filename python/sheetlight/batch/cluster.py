"""Workers on an existing Ray cluster: one actor a device."""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from .._error import SheetlightError
from .._optional import needed
from . import shard
from .shard import Went
from .workers import Lost

#: How long a new actor may wait for its place, s.
PLACE_S = 120.0
#: How often the head is asked, s, and how often in a row it may stay silent.
ASK_S, SILENT = 5.0, 3


def connect(address: str) -> Any:
    """The module ray, connected to the cluster."""
    ray = needed("ray", "a batch on a Ray cluster", "ray")
    try:
        if ":" in address and "//" not in address:
            # Ray itself tries for minutes.
            _knock(address, ASK_S)
        ray.init(address=address, logging_level="ERROR", log_to_driver=False)
    except Exception as error:
        raise SheetlightError(
            f"no Ray cluster answers at '{address}': {error}",
            "no cluster was started, its head cannot be reached, or this process has not the cluster's token",
            "give the address of its head; where it has a token, set RAY_AUTH_MODE and RAY_AUTH_TOKEN too",
        ) from error
    # Functions of that module travel as they are.
    needed("ray.cloudpickle", "a batch on a Ray cluster", "ray").register_pickle_by_value(shard)
    return ray


def _knock(address: str, seconds: float) -> None:
    """Raises where nothing listens at HOST:PORT."""
    host, _, port = address.rpartition(":")
    socket.create_connection((host.strip("[]"), int(port)), timeout=seconds).close()


def actors(address: str, count: int | None) -> list[Actor]:
    """Actors on a cluster: one for each GPU. Without any, one for each node: the program uses all cores of one."""
    ray = connect(address)
    watch_head(ray)
    has = ray.cluster_resources()
    gpus = int(has.get("GPU", 0))
    count = count or gpus or sum(node["Alive"] for node in ray.nodes())
    share = min(1.0, has.get("CPU", 1.0) / count)
    return [Actor(ray, number, share, gpus >= count) for number in range(1, count + 1)]


class Actor:
    """A worker on the cluster. A lost one is replaced when the next shard comes."""

    def __init__(self, ray: Any, number: int, share: float, gpu: bool) -> None:
        self.name = f"actor {number}"
        self._ray = ray
        resources = {"num_gpus": 1, "num_cpus": 0} if gpu else {"num_cpus": share}

        # The function by value: nodes need the program, not this package.
        run_program = shard.run

        class Runner:
            """Runs the program on its node."""

            def ready(self) -> int:
                return os.getpid()

            def run(self, command: list[str]) -> tuple[int, list[dict[str, Any]], dict[str, str] | None]:
                return tuple(run_program(command))  # type: ignore[return-value]

        options = {"max_restarts": 0, "scheduling_strategy": "SPREAD", **resources}
        self._make = ray.remote(Runner).options(**options).remote
        self._actor: Any = None

    def run(self, command: list[str], heard: Callable[[dict[str, Any]], None]) -> Went:
        """Runs the program on the actor's node; its lines come at the shard's end."""
        failures = self._ray.exceptions
        try:
            if self._actor is None:
                self._actor = self._make()
                self._ray.get(self._actor.ready.remote(), timeout=PLACE_S)
            went = Went(*self._ray.get(self._actor.run.remote(command)))
        except (failures.RayActorError, failures.GetTimeoutError, failures.WorkerCrashedError) as error:
            self.close()
            raise Lost(str(error).strip().split("\n")[0]) from error
        except failures.RayTaskError as error:
            # Raised within the actor: the program is not on its node.
            raise SheetlightError(
                f"{self.name} cannot run {command[0]}: {error.cause if hasattr(error, 'cause') else error}",
                "the program is not installed on every node of the cluster",
                "install the same version on all nodes, or give its path with --program",
            ) from error
        if went.code < 0:
            raise Lost(f"its program was ended by signal {-went.code}")
        for line in went.lines:
            heard(line)
        return went

    def close(self) -> None:
        """Gives the device back."""
        if self._actor is not None:
            actor, self._actor = self._actor, None
            self._ray.kill(actor)


def watch_head(ray: Any) -> None:
    """Ends this process with an error when the cluster's head is gone: calls wait for it for a minute and abort."""
    host, _, port = ray.get_runtime_context().gcs_address.rpartition(":")

    def watch() -> None:
        silent = 0
        while True:
            time.sleep(ASK_S)
            try:
                _knock(f"{host}:{port}", ASK_S)
                silent = 0
            except OSError as error:
                silent += 1
                if silent == SILENT:
                    fault = SheetlightError(
                        f"the head of the Ray cluster at {host}:{port} did not answer {SILENT} times in "
                        f"{SILENT * ASK_S:.0f} s: {error}",
                        "its machine or its process was stopped, or the network is cut",
                        "start the cluster again, then run the same command: recordings with results are kept",
                    )
                    print(f"error: {fault}", file=sys.stderr, flush=True)
                    os._exit(1)

    threading.Thread(target=watch, daemon=True, name="watch of the head").start()
