"""`rendulic info`: what a saved state is, or how far a study is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rendulic.chang_hicher.point import MaterialPoint
    from rendulic.dem.assembly import Assembly
    from rendulic.specimen import Specimen

__all__ = ["info"]

SHOWN = 20  # missing units that are named


def info(
    file: Annotated[Path, typer.Argument(help="A state file (.h5), or the folder of a study.")],
    check: Annotated[
        bool, typer.Option("--check", help="Of a study: read every result, and name the damaged.")
    ] = False,
) -> None:
    """Say what a saved state holds and whether it is at rest, or what of a study is done, running, failed, missing.

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
    typer.echo(f"{file}: {lines[0]}")
    typer.echo(f"  stress    {stress[0]:.2f}, {stress[1]:.2f}, {stress[2]:.2f} kPa, eta = {_eta(specimen):.4f}")
    typer.echo(f"  strain    {strain[0]:.6f}, {strain[1]:.6f}, {strain[2]:.6f}")
    for line in lines[1:]:
        typer.echo(f"  {line}")


def _of_study(folder: Path, check: bool) -> None:
    from collections import Counter

    from rendulic.study.campaign import recorded

    units, store = recorded(folder)
    found = store.keys()
    damaged = store.damaged(found & set(units)) if check else {}
    running = (store.read_json("running.json") or {}) if store.is_claimed() else {}
    failed = {key: note for key, note in store.failures().items() if key in units and key not in found}
    total, done = Counter(unit.kind for unit in units.values()), Counter(units[key].kind for key in found & set(units))
    typer.echo(f"{folder}: {sum(done.values())} of {len(units)} units are done")
    for kind, count in total.items():
        typer.echo(f"  {kind:<12} {done[kind]} of {count}")
    for key in set(units) & set(running) - found:
        share = running[key]
        far = f" {100 * share[0] / share[1]:.0f} %, {share[2]}" if share and share[1] else ""
        typer.echo(f"  running: {units[key].label}{far}")
    for note in failed.values():
        typer.echo(f"  failed: {note['label']}: {note['error']}")
    for error in damaged.values():
        typer.echo(f"  damaged: {error}")
    missing = [unit.label for key, unit in units.items() if key not in found | set(running) | set(failed)]
    for label in missing[:SHOWN]:
        typer.echo(f"  missing: {label}")
    if len(missing) > SHOWN:
        typer.echo(f"  and {len(missing) - SHOWN} more")
    if others := len(found - set(units)):
        typer.echo(f"  {others} more results of other versions of the study are kept")


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
