"""Progress on the terminal: one bar per stage, plain lines where there is no terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from rendulic.progress import Progress as Callback
from rendulic.progress import silent

__all__ = ["stages"]

SECONDS_BETWEEN_LINES = 15.0


@contextmanager
def stages(quiet: bool = False) -> Iterator[Callable[[str], Callback]]:
    """Yield a function that opens a named stage and returns its progress callback."""
    if quiet:
        yield lambda _name: silent
        return
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda name: _lines(console, name)
        return
    bars = Progress(
        TextColumn("{task.description}"), BarColumn(bar_width=24), TaskProgressColumn(), TimeElapsedColumn(),
        TimeRemainingColumn(compact=True), TextColumn("[dim]{task.fields[note]}"), console=console,
    )  # fmt: skip

    def open_stage(name: str) -> Callback:
        task = bars.add_task(name, total=None, note="", visible=False)

        def show(done: float, total: float, note: str = "") -> None:
            bars.update(task, completed=done, total=total, note=note, visible=True)

        return show

    with bars:
        yield open_stage


def _lines(console: Console, name: str) -> Callback:
    """Progress as a line now and then."""
    lock, start, last = Lock(), time.monotonic(), [0.0]

    def show(done: float, total: float, note: str = "") -> None:
        now = time.monotonic()
        with lock:
            if now - last[0] < SECONDS_BETWEEN_LINES and done < total:
                return
            last[0] = now
        share = done / total if total else 0.0
        left = f", {(now - start) * (1 - share) / share:.0f} s left" if 0.02 < share < 1 else ""
        console.print(
            f"{name}: {100 * share:.0f} % after {now - start:.0f} s{left}; {note}",
            highlight=False,
            soft_wrap=True,
        )

    return show
