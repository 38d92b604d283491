"""`rendulic probe`: probe a saved state."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.progress import stages
from rendulic.cli.terminal import say
from rendulic.loading.rate import STRAIN_PER_STEP

__all__ = ["probe"]


def probe(
    state: Annotated[Path, typer.Argument(help="A state file (.h5), or grains of Yade (.npz).")],
    norm: Annotated[list[float] | None, typer.Option(help="Norm of the strain increment; repeat for a sweep.")] = None,
    step: Annotated[float, typer.Option(help="Angle between directions in degrees.")] = 10.0,
    rate: Annotated[float, typer.Option(min=0.0, help="Strain per time step; for grains.")] = STRAIN_PER_STEP,
    settle: Annotated[bool, typer.Option(help="Hold the walls until the grains are at rest, then read.")] = True,
    check_rate: Annotated[
        bool, typer.Option(help="Probe at half the rate, too; the change is part of the error.")
    ] = False,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for data and figures.")] = Path("probes"),
    workers: Annotated[int | None, typer.Option(min=1, help="Threads; one per core if not given.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the result.")] = False,
) -> None:
    """Probe a state in all directions of the Rendulic plane and draw its circular diagram.

    Example: rendulic probe demo/paper_seed_1/state_eta_0.480.h5 --norm 5e-5 --norm 2e-4 --step 20 -o demo/again
    """
    from rendulic import figures
    from rendulic.cli.specimens import read_specimen
    from rendulic.foundation.whole_file import writable_folder
    from rendulic.io.tables import write_dataset
    from rendulic.loading import directions
    from rendulic.probing.probe import doubts, probes_of
    from rendulic.tensors.invariants import stress_ratio

    sample = read_specimen(state)
    writable_folder(output)
    with stages(quiet) as stage:
        probes = probes_of(
            sample,
            directions.rendulic(step),
            sorted(norm or [5e-5]),
            rate=rate,
            settle=settle,
            check_rate=check_rate,
            workers=workers,
            progress=stage("probes"),
        )
    write_dataset(probes, output / "probes.nc")
    named = {f"norm {float(value):g}": probes.sel(norm=value) for value in probes.norm}
    figures.save(
        figures.circular_diagram(named, rf"$\eta$ = {float(stress_ratio(sample.stress)):.2f}"), output, "circular"
    )
    for value in probes.norm.values:
        one = probes.sel(norm=value)
        worst = one.isel(alpha=int(one.w2_normalised.argmin("alpha")))
        say(
            f"norm {value:g}: smallest W2n {float(worst.w2_normalised):+.4f} +/- {float(worst.w2_normalised_error):.2g} at "
            f"{float(worst.alpha):.0f} degrees ({'the sign is sure' if bool(worst.is_significant) else 'the sign is not sure'})"
            + (
                f", largest identity residual {float(one.identity_residual.max()):.0e}"
                if "identity_residual" in one
                else ""
            )
        )
    for sentence in doubts(probes):
        say(f"Warning: {sentence}.", err=True)
    say(f"written to {output}")
