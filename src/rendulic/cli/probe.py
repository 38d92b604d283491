"""`rendulic probe`: probe a saved state."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rendulic.cli.progress import stages

__all__ = ["probe"]


def probe(
    state: Annotated[Path, typer.Argument(help="A state file (.h5), or grains of Yade (.npz).")],
    norm: Annotated[list[float] | None, typer.Option(help="Norm of the strain increment; repeat for a sweep.")] = None,
    step: Annotated[float, typer.Option(help="Angle between directions in degrees.")] = 10.0,
    n_steps: Annotated[int, typer.Option(min=1, help="Time steps up to the smallest norm; for grains.")] = 5000,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for data and figures.")] = Path("probes"),
    workers: Annotated[int | None, typer.Option(min=1, help="Threads; one per core if not given.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the result.")] = False,
) -> None:
    """Probe a state in all directions of the Rendulic plane and draw its circular diagram.

    Example: rendulic probe demo/paper_seed_1/state_eta_0.480.h5 --norm 5e-5 --norm 2e-4 --step 20 --n-steps 1000 -o demo/again
    """
    from rendulic import figures
    from rendulic.cli.specimens import read_specimen
    from rendulic.foundation.whole_file import writable_folder
    from rendulic.io.tables import write_dataset
    from rendulic.loading import directions
    from rendulic.probing.probe import probe as run_probes
    from rendulic.tensors.invariants import stress_ratio

    sample = read_specimen(state)
    writable_folder(output)
    with stages(quiet) as stage:
        probes = run_probes(
            sample,
            directions.rendulic(step),
            sorted(norm or [5e-5]),
            n_steps,
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
        typer.echo(
            f"norm {value:g}: smallest W2n {float(worst.w2_normalised):+.4f} at {float(worst.alpha):.0f} degrees "
            f"({'significant' if bool(worst.is_significant) else 'within the drift of the null probe'})"
            + (
                f", largest identity residual {float(one.identity_residual.max()):.0e}"
                if "identity_residual" in one
                else ""
            )
        )
    typer.echo(f"written to {output}")
