"""`rendulic lab`: second-order work along a triaxial test from a laboratory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.terminal import say

__all__ = ["lab"]

TOLD = 5  # rows that were dropped
MOST_FIGURES = 12


def lab(
    test: Annotated[Path, typer.Argument(help="A TOML file that names the file of readings, its columns and units.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for tables and the figure.")] = Path("lab"),
    guess: Annotated[
        bool, typer.Option("--guess", help="Take TEST for a file of readings, print a description to check, and stop.")
    ] = False,
    init: Annotated[bool, typer.Option("--init", help="Write a commented file to begin with, and stop.")] = False,
) -> None:
    """Second-order work along a measured triaxial test, and where instability becomes possible.

    Example: rendulic lab readings.dat --guess > test.toml && rendulic lab test.toml -o lab
    """
    from rendulic.cli.init import write_new
    from rendulic.figures.draw import draw
    from rendulic.figures.style import save
    from rendulic.io.lab.guess import guess_description
    from rendulic.study.language.lab import example, run_lab_test
    from rendulic.views.path_work import path_work

    if guess:
        say(guess_description(test), nl=False)
        return
    if init:
        write_new(test, example())
        return
    result = run_lab_test(test, output)
    files = list(result.files)
    for part in result.parts:
        measured, found = part.measured, part.along
        name = f"{test}" if len(result.parts) == 1 else f"{test}: {part.title}"
        if found is None:
            say(f"{name}: {part.why_not}")
            continue
        say(f"{name}: {found.attrs['verdict']}")
        if found.instability_q.notnull():
            told = f"  q = {float(found.instability_q) / 1e3:.2f} kPa"
            if found.instability_p.notnull():
                told += f", p' = {float(found.instability_p) / 1e3:.2f} kPa, eta = {float(found.instability_eta):.3f}"
            say(told)
        for peak, least, by in zip(found.peak_q.values, found.minimum_q.values, found.falls_by.values, strict=True):
            say(f"  q falls from {peak / 1e3:.2f} to {least / 1e3:.2f} kPa, by {100 * by / abs(peak):.1f} %")
        for note in filter(None, measured.attrs["notes"].split("; ")):
            say(f"  look at it: {note}")
        if measured.attrs["n_dropped"]:
            say(f"  {measured.attrs['n_dropped']} rows of the file dropped: {shortened(measured.attrs['dropped'])}")
        if len(result.parts) <= MOST_FIGURES:
            files += save(draw(path_work(measured, found, part.title)), part.folder, "w2")
    if len(result.parts) > MOST_FIGURES:
        say(f"figures are drawn of up to {MOST_FIGURES} loadings: choose one by leg or where")
    say(f"{len(files)} files written to {output}")


def shortened(dropped: str) -> str:
    """The first few of what was dropped; all of it is in the tables' attributes."""
    told = dropped.split("; line ")
    return "; line ".join(told[:TOLD]) + (f"; and {len(told) - TOLD} more" if len(told) > TOLD else "")
