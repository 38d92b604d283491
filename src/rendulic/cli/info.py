"""`rendulic info`: what a saved state is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["info"]


def info(file: Annotated[Path, typer.Argument(help="A state file (.h5).")]) -> None:
    """Say what a saved state holds, and whether it is at rest.

    Example: rendulic info demo/specimen.h5
    """
    from rendulic.dem.assembly import Assembly
    from rendulic.micro.coordination import coordination
    from rendulic.state import State

    sample = Assembly.from_state(State.from_file(file))
    stress, strain = sample.stress.diagonal() / 1e3, sample.strain.diagonal()
    numbers = coordination(sample.snapshot())
    typer.echo(f"{file}: {len(sample)} grains, {sample.n_contacts} contacts, {type(sample.law).__name__}")
    typer.echo(f"  stress    {stress[0]:.2f}, {stress[1]:.2f}, {stress[2]:.2f} kPa, eta = {sample.eta:.4f}")
    typer.echo(f"  strain    {strain[0]:.6f}, {strain[1]:.6f}, {strain[2]:.6f}")
    typer.echo(f"  porosity  {sample.porosity:.4f}, time step {sample.time_step:.3g} s")
    typer.echo(
        f"  coordination {numbers.mean:.3f}, without rattlers {numbers.mechanical:.3f} ({100 * numbers.rattlers:.1f} % rattlers)"
    )
    typer.echo(f"  {sample.equilibrium()}")
