"""Workers of a Dask cluster that see the study's folder: orders are sent as plain JSON, results come as files."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import re
import threading
import time
from collections.abc import Mapping
from concurrent.futures import CancelledError
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from rendulic.foundation.errors import InvalidInput, RendulicError
from rendulic.foundation.json_text import read_json_text
from rendulic.study.execution.executor import Event

__all__ = ["ClusterWorkers", "carry_out_on_worker"]

TOPIC = "rendulic"
ADDRESS = re.compile(r"((tcp|tls|ws|wss|ucx)://)?([\w.-]+|\[[0-9A-Fa-f:.%\w]+\]):[0-9]{1,5}")
TO_SAY_WHO = 7.0  # seconds for whatever is at the address to say that it is a scheduler
PATIENCE = 30  # seconds for the scheduler to answer
SECONDS_PER_COUNT = 10.0  # between counts of the workers, which come and go


class ClusterWorkers:
    """The workers of a Dask scheduler.

    Parameters
    ----------
    folder : path
        Of the study, under the same name on all machines.
    address : str
        Of the scheduler, as `tcp://host:8786`, or `tls://host:8786` with the certificates of Dask's configuration; or
        the name of its scheduler file.

    Raises
    ------
    InvalidInput
        If `distributed` is not installed, there is no scheduler, or it has no workers.
    """

    def __init__(self, folder: str | os.PathLike, address: str) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise InvalidInput(
                "a Dask scheduler needs the package distributed: pip install 'rendulic[cluster]'"
            ) from None
        # what goes wrong with the cluster is told in one sentence, by errors from here
        for name in logging.root.manager.loggerDict:
            if name.partition(".")[0] == "distributed":
                logging.getLogger(name).setLevel(logging.CRITICAL)
        self.folder = str(Path(folder).absolute())
        self._events: SimpleQueue[Event] = SimpleQueue()
        self._futures: dict[str, Any] = {}
        address = _address(address)
        _expect_scheduler(address)
        try:
            self._client = Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError, ImportError) as error:
            raise InvalidInput(f"no Dask scheduler at {address}: {error or type(error).__name__}") from None
        self._count()
        if not self.capacity:
            self.close()
            raise InvalidInput(f"the Dask scheduler at {address} has no workers: start some first")
        self._client.subscribe_topic(TOPIC, self._hear)

    def _count(self) -> None:
        """How many units run at once now, and as many more, so that no worker waits for its next order."""
        self.capacity = self.ahead = sum(self._client.nthreads().values())
        self._counted = time.monotonic()

    def _hear(self, message: tuple[Any, Any]) -> None:
        told = message[1] if isinstance(message, tuple) else message
        if isinstance(told, dict) and told.get("folder") == self.folder:
            self._events.put(Event("progress", told["key"], told["progress"]))

    def submit(self, order: Mapping[str, Any], threads: int) -> None:
        """Hand a unit to the scheduler; `threads` does not matter, as workers there have a thread for each unit."""
        future = self._client.submit(
            carry_out_on_worker, json.dumps(order), self.folder, key=f"rendulic-{order['key']}-{id(self)}",
            pure=False,
        )  # fmt: skip
        self._futures[order["key"]] = future
        future.add_done_callback(lambda ended, key=order["key"]: self._events.put(Event("ended", key, ended)))

    def events(self, seconds: float) -> list[Event]:
        """What happened, after so many seconds at most."""
        if self._client.status == "running" and time.monotonic() - self._counted > SECONDS_PER_COUNT:
            with suppress(OSError, TimeoutError):
                self._count()
        happened = []
        with suppress(Empty):
            event = self._events.get(timeout=seconds)
            while True:
                happened.append(self._read(event) if event.what == "ended" else event)
                event = self._events.get_nowait()
        if not happened and self._client.status not in ("running", "connecting"):
            raise _gone(self._client.status)
        return happened

    def _read(self, event: Event) -> Event:
        """The answer of a worker."""
        future = self._futures.pop(event.key, event.about)
        if future.status == "cancelled":
            raise _gone("cancelled")
        try:
            # a worker that has died before its answer was fetched is known by its error
            error = future.exception(timeout=PATIENCE) if future.status == "error" else None
            answer = None if error is not None else json.loads(future.result(timeout=PATIENCE))
        except (OSError, TimeoutError, CancelledError) as lost:
            raise _gone(str(lost) or type(lost).__name__) from None
        if answer is not None:
            ((what, about),) = answer.items()
            return Event(what, event.key, about)
        if type(error).__name__ == "KilledWorker":
            return Event("lost", event.key)
        return Event("failed", event.key, {"error": f"{type(error).__name__}: {error}", "is_final": False})

    def close(self) -> None:
        """Cancel what has not begun, and leave the cluster to itself."""
        # a scheduler that is gone has nothing to cancel
        with suppress(Exception):
            if self._client.status == "running":
                self._client.cancel(list(self._futures.values()), force=True)
        with suppress(Exception):
            self._client.close(timeout=PATIENCE)


def _address(given: str) -> str:
    """The address of a scheduler, from itself or from a scheduler file."""
    address: object = given
    if Path(given).is_file():
        try:
            address = read_json_text(Path(given).read_bytes())["address"]
        except (OSError, ValueError, TypeError, KeyError, IndexError):
            raise InvalidInput(f"{given} is no scheduler file of Dask: expected JSON with an 'address'") from None
    if not isinstance(address, str) or not ADDRESS.fullmatch(address):
        place = "" if address == given else f" in {given}"
        raise InvalidInput(
            f"the address of a Dask scheduler is like tcp://host:8786, or a scheduler file; got {str(address)[:200]!r}{place}"
        )
    return address


def _expect_scheduler(address: str) -> None:
    """Raise `InvalidInput` unless a scheduler answers soon; the client of Dask waits minutes for what never answers.

    In a thread of its own, as there may be an event loop in this one; and left alone, if it does not end.
    """
    answers: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=lambda: answers.put(asyncio.run(_who_is_at(address))), daemon=True).start()
    try:
        found = answers.get(timeout=TO_SAY_WHO + 1.0)
    except Empty:
        found = "it does not answer"
    if found != "Scheduler":
        raise InvalidInput(f"no Dask scheduler at {address}: {found}")


async def _who_is_at(address: str) -> str:
    """What kind of server it says that it is, or why that is not known."""
    from distributed.core import rpc
    from distributed.security import Security

    try:
        arguments = Security().get_connection_args("client")
        async with asyncio.timeout(TO_SAY_WHO):
            async with rpc(address, timeout=TO_SAY_WHO, connection_args=arguments) as server:
                kind = str((await server.identity())["type"])
        return kind if kind == "Scheduler" else f"it is a {kind}"[:200]
    except TimeoutError:
        return "it does not answer"
    except OSError as error:
        return " ".join(str(error).split())[:200] or type(error).__name__
    # whatever a server that is none may send
    except Exception as error:
        return f"what answers there is no scheduler ({' '.join(str(error).split())[:200] or type(error).__name__})"


def _gone(why: str) -> RendulicError:
    return RendulicError(
        f"the Dask scheduler is gone or has cancelled the work ({why}): start it again, and then this run"
    )


def carry_out_on_worker(order: str, folder: str) -> str:
    """What a Dask worker runs: order and answer in JSON, the result as a file of the folder."""
    from distributed import get_worker

    from rendulic.study.execution.worker import answer_to

    worker, asked = get_worker(), json.loads(order)

    def tell(answer: dict[str, Any]) -> None:
        worker.log_event(TOPIC, {"folder": folder, "key": asked["key"], **answer})

    return json.dumps(answer_to(asked, folder, 1, tell))
