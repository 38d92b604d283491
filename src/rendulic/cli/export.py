"""`rendulic export`: states and tables for ParaView, spreadsheets and other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.terminal import say

__all__ = ["export"]


def export(
    source: Annotated[
        Path, typer.Argument(help="A state of grains of any engine, a table (.nc), or a folder of results.")
    ],
    to: Annotated[
        str | None, typer.Option(help="vtkhdf, csv, netcdf or lammps; by default vtkhdf for grains, csv for tables.")
    ] = None,
    before: Annotated[
        Path | None, typer.Option(help="The state before: adds displacement and second-order work.")
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the files.")] = Path("exported"),
) -> None:
    """Write grains for ParaView (VTKHDF: grains, contacts, walls), as plain text or as an input of LAMMPS; write tables as CSV.

    Example: rendulic export after.h5 --before before.h5 --to vtkhdf -o paraview
    """
    from rendulic.io.export import export as write
    from rendulic.io.export import export_all
    from rendulic.io.reading import read

    first = None if before is None else read(before)
    if source.is_dir() and not (source / "box.toml").is_file():
        written, passed_over = export_all(source, output, to, first)
        for reason in passed_over:
            say(f"passed over: {reason}", err=True)
    else:
        written = write(source, output, to, first)
    for path in written:
        say(path)
