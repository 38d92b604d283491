"""`rendulic element`: element tests with the Chang-Hicher model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from rendulic.cli.init import write_new
from rendulic.cli.progress import stages

if TYPE_CHECKING:
    from rendulic.study.element_results import ElementResult

__all__ = ["element"]


def element(
    study: Annotated[Path, typer.Argument(help="A TOML file of tests.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for tables and figures.")] = Path("elements"),
    init: Annotated[bool, typer.Option("--init", help="Write a commented file to begin with, and stop.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the table.")] = False,
) -> None:
    """Run element tests with the Chang-Hicher model: curves, planes and events as CSV and NetCDF, figures.

    Example: rendulic element tests.toml --init && rendulic element tests.toml -o elements
    """
    from rendulic.study.element_results import run_element_study
    from rendulic.study.language.element import example, read_element_study

    if init:
        write_new(study, example())
        return
    read = read_element_study(study)
    with stages(quiet) as stage:
        results = run_element_study(read, output, stage=stage)
    Console().print(_summary(results))
    typer.echo(f"{sum(len(result.files) for result in results)} files written to {output}")


def _summary(results: list[ElementResult]) -> Table:
    """One row per test: peak, end, and the first plane that loses work."""
    shown = Table(
        title="Element tests", box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1),
        caption="q, p in kPa, axial strain in %; first plane: the one that first loses second-order work",
    )  # fmt: skip
    shown.add_column("test", no_wrap=True)
    shown.add_column("stopped by", min_width=10, overflow="fold")
    for heading in ("peak q, p", "eps_1", "end q, p", "first plane"):
        shown.add_column(heading, justify="right", no_wrap=True)
    for result in results:
        curve = result.curve
        peak, plane = _first(curve, "q_peak"), _first(curve, "plane_w2_lost")
        shown.add_row(
            result.name,
            curve.attrs["stopped_by"],
            "-" if peak is None else f"{float(curve.event_q[peak]) / 1e3:.1f}, {float(curve.event_p[peak]) / 1e3:.1f}",
            "-" if peak is None else f"{100 * float(curve.event_eps_1[peak]):.2f}",
            f"{float(curve.q[-1]) / 1e3:.1f}, {float(curve.p[-1]) / 1e3:.1f}",
            "-" if plane is None else f"{100 * float(curve.event_eps_1[plane]):.2f} "
            f"({float(curve.inclination[int(curve.event_plane[plane])]):.0f} deg)",
        )  # fmt: skip
    return shown


def _first(curve, kind: str) -> int | None:
    """Index of the first event of a kind."""
    found = (curve.event_kind.values == kind).nonzero()[0]
    return int(found[0]) if len(found) else None
