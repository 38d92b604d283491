"""`rendulic info`: what a saved state is, or how far a study is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rendulic.cli.run import DAMAGED
from rendulic.cli.terminal import say

if TYPE_CHECKING:
    from rendulic.chang_hicher.point import MaterialPoint
    from rendulic.dem.assembly import Assembly
    from rendulic.specimen.protocol import Specimen

__all__ = ["info"]

SHOWN = 20  # missing units that are named


def info(
    file: Annotated[Path, typer.Argument(help="A state file (.h5), or the folder of a study.")],
    check: Annotated[
        bool, typer.Option("--check", help="Of a study: read every result, and name those that are damaged.")
    ] = False,
) -> None:
    """Say what a saved state holds and whether it is at rest; of a study, what is done, running, failed or missing.

    Example: rendulic info demo/paper_seed_1/specimen.h5
    """
    if file.is_dir():
        _of_study(file, check)
        return
    from rendulic.cli.specimens import read_specimen
    from rendulic.dem.assembly import Assembly

    specimen = read_specimen(file)
    lines = _of_grains(specimen) if isinstance(specimen, Assembly) else _of_point(specimen)
    stress, strain = specimen.stress.diagonal() / 1e3, specimen.strain.diagonal()
    say(f"{file}: {lines[0]}")
    say(f"  stress    {stress[0]:.2f}, {stress[1]:.2f}, {stress[2]:.2f} kPa, eta = {_eta(specimen):.4f}")
    say(f"  strain    {strain[0]:.6f}, {strain[1]:.6f}, {strain[2]:.6f}")
    for line in lines[1:]:
        say(f"  {line}")


def _of_study(folder: Path, check: bool) -> None:
    from rendulic.study.execution.campaign import results_in
    from rendulic.study.execution.status import status_of

    status = status_of(folder)
    say(f"{folder}: {status.done} of {status.total} units are done")
    for kind, (done, count) in status.kinds.items():
        say(f"  {kind:<12} {done} of {count}")
    for unit, share in status.running.items():
        far = f" {100 * share[0] / share[1]:.0f} %, {share[2]}" if share and share[1] else ""
        say(f"  running: {unit.label}{far}")
    for unit, why in status.failed.items():
        say(f"  failed: {unit.label}: {why}")
    damaged: dict = {}
    if check:
        results = results_in(folder)
        damaged = results.store.damaged(results.done & set(results.wanted))
        for error in damaged.values():
            say(f"  damaged: {error}")
    for unit in status.missing[:SHOWN]:
        say(f"  missing: {unit.label}")
    if len(status.missing) > SHOWN:
        say(f"  and {len(status.missing) - SHOWN} more")
    if status.others:
        say(f"  {status.others} more results of other versions of the study are kept")
    if damaged:
        raise typer.Exit(DAMAGED)


def _eta(specimen: Specimen) -> float:
    from rendulic.tensors.invariants import stress_ratio

    return float(stress_ratio(specimen.stress))


def _of_grains(sample: Assembly) -> list[str]:
    from rendulic.micro.coordination import coordination

    numbers = coordination(sample.snapshot())
    return [
        f"{len(sample)} grains, {sample.n_contacts} contacts, {type(sample.law).__name__}",
        f"porosity  {sample.porosity:.4f}, time step {sample.time_step:.3g} s",
        f"coordination {numbers.mean:.3f}, without rattlers {numbers.mechanical:.3f} "
        f"({100 * numbers.rattlers:.1f} % rattlers)",
        str(sample.equilibrium()),
    ]


def _of_point(point: MaterialPoint) -> list[str]:
    largest = point.planes()["x"].max()
    return [
        f"point of {point.model!r}",
        f"void ratio {point.void_ratio:.4f}",
        f"largest obliquity of a contact plane {100 * largest:.1f} % of its peak friction",
    ]
