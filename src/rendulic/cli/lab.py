"""`rendulic lab`: second-order work along a triaxial test from a laboratory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["lab"]


def lab(
    test: Annotated[Path, typer.Argument(help="A TOML file that names the CSV file, its columns and units.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for tables and the figure.")] = Path("lab"),
    init: Annotated[bool, typer.Option("--init", help="Write a commented file to begin with, and stop.")] = False,
) -> None:
    """Second-order work along a measured triaxial test, and where instability becomes possible.

    Example: rendulic lab test.toml --init && rendulic lab test.toml -o lab
    """
    from rendulic.cli.init import write_new
    from rendulic.figures.draw import draw
    from rendulic.figures.style import save
    from rendulic.study.language.lab import example, run_lab_test
    from rendulic.views.path_work import path_work

    if init:
        write_new(test, example())
        return
    result = run_lab_test(test, output)
    view, found = path_work(result.measured, result.along, result.title), result.along
    files = [*result.files, *save(draw(view), output, "w2")]
    typer.echo(f"{test}: {view.verdict}")
    if found.instability_q.notnull():
        typer.echo(
            f"  q = {float(found.instability_q) / 1e3:.2f} kPa, p' = {float(found.instability_p) / 1e3:.2f} kPa, "
            f"eta = {float(found.instability_eta):.3f}"
        )
    for peak, least, by in zip(found.peak_q.values, found.minimum_q.values, found.falls_by.values, strict=True):
        typer.echo(f"  q falls from {peak / 1e3:.2f} to {least / 1e3:.2f} kPa, by {100 * by / abs(peak):.1f} %")
    typer.echo(f"{len(files)} files written to {output}")
