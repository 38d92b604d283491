"""A process that carries out units: `python -m rendulic.study.execution.worker FOLDER`, orders and answers in lines of JSON.

An order on standard input is `{"order": ..., "threads": n}`. Answers on standard output are `{"progress": [done, total,
note]}`, and at last `{"done": true}` or `{"failed": {"error": ..., "is_final": ...}}` or, if the result cannot be kept,
`{"stopped": ...}`. When its input ends, because the process that started it has ended, the worker ends at once.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from rendulic.foundation.errors import CorruptFile, DidNotConverge, InvalidInput, NotEquilibrated, UnstableTimeStep
from rendulic.study.store.store import Store
from rendulic.study.store.unit import check_order

__all__ = ["Answer", "answer_to"]

Answer = dict[str, Any]
BETWEEN_REPORTS, BETWEEN_NOTES = 0.3, 30.0  # seconds between reports of progress, and notes of it in the log
# what the mechanics decides: the same work fails again
FINAL = (DidNotConverge, InvalidInput, NotEquilibrated, UnstableTimeStep)


def answer_to(order: Mapping[str, Any], folder: str, threads: int, tell: Callable[[Answer], None]) -> Answer:
    """Carry out a unit and keep its result; the last answer is returned, those of progress are told."""
    from rendulic.dem.drive.team import use_threads
    from rendulic.study.task import How, task_from

    store = Store(folder)
    log = _Log(store.folder / "logs" / f"{order['key']}.log", order["label"])
    try:
        check_order(order)
    except InvalidInput as error:
        return {"stopped": str(error)}
    last = [0.0]

    def progress(done: float, total: float, note: str = "") -> None:
        now = time.monotonic()
        if now - last[0] >= BETWEEN_REPORTS or done >= total:
            last[0] = now
            tell({"progress": [float(done), float(total), note]})
        log.progress(done, total, note)

    use_threads(threads)
    try:
        log.line(f"begun by rendulic {order['rendulic']}, process {os.getpid()}, {threads} threads")
        needs = {role: store.read(key) for role, key in order["needs"].items()}
        parts = task_from(order["kind"], order["inputs"]).run(needs, How(progress, threads))
    except FINAL as error:
        log.line(f"failed: {error}")
        return {"failed": {"error": f"{type(error).__name__}: {error}", "is_final": True}}
    except Exception as error:  # a damaged input, too little memory, a mistake of ours: another time it may do
        log.line(traceback.format_exc() if not isinstance(error, CorruptFile) else f"failed: {error}")
        return {"failed": {"error": f"{type(error).__name__}: {error}", "is_final": False}}
    try:
        store.write(order, parts)
    except InvalidInput as error:
        return {"stopped": str(error)}
    log.line("done")
    return {"done": True}


class _Log:
    """Lines with the time; a log that cannot be written is no reason to stop."""

    def __init__(self, path: Path, label: str) -> None:
        self.path, self.label, self.last = path, label, time.monotonic()

    def line(self, text: str) -> None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as log:
                log.write(f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} {self.label}: {text}\n")
        except OSError:
            pass

    def progress(self, done: float, total: float, note: str) -> None:
        now = time.monotonic()
        if now - self.last >= BETWEEN_NOTES:
            self.last = now
            self.line(f"{100 * done / total if total else 0:.1f} %, {note}")


def _serve(folder: str) -> None:
    """Answer orders until there are no more."""
    # answers have a channel of their own, so that nothing printed by anyone can be taken for one
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    orders: SimpleQueue[str] = SimpleQueue()

    def listen() -> None:
        for line in sys.stdin:
            orders.put(line)
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()

    def tell(answer: Answer) -> None:
        answers.write(json.dumps(answer) + "\n")

    while True:
        asked = json.loads(orders.get())
        tell(answer_to(asked["order"], folder, asked["threads"], tell))


if __name__ == "__main__":
    _serve(sys.argv[1])
