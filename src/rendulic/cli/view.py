"""`rendulic view`: a running study in the browser."""

from __future__ import annotations

import signal
import webbrowser
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from rendulic.cli.terminal import say

__all__ = ["view"]


def view(
    folder: Annotated[Path, typer.Argument(help="The folder of a study, running or not.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0: any that is free.")] = 8470,
    open_browser: Annotated[bool, typer.Option("--open/--no-open", help="Show it in the browser.")] = True,
) -> None:
    """Show a study while it runs: progress, curves so far, the report of what is done. Only this machine can see it.

    Ends with Ctrl-C.

    Example: rendulic view results
    """
    from rendulic.report.live import LiveView

    with LiveView(folder, port) as live:
        signal.signal(signal.SIGTERM, _end)
        say(f"{live.address} shows {folder}; end with Ctrl-C")
        if open_browser:
            webbrowser.open(live.address)
        try:
            live.serve()
        except KeyboardInterrupt:
            say("ended")


def _end(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt
