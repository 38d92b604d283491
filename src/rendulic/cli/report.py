"""`rendulic report`: a study as one page to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.terminal import say

__all__ = ["report"]


def report(
    folder: Annotated[Path, typer.Argument(help="The folder of a study, finished or not; see rendulic run.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file; report.html in the folder if not given.")
    ] = None,
) -> None:
    """Write one HTML page of a study: its results, how far to trust them, what was run. It needs no network.

    Example: rendulic report results
    """
    from rendulic.report import write_report

    path = write_report(folder, output)
    say(f"{path}: {path.stat().st_size / 1e6:.1f} MB, open it in a browser")
