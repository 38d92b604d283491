"""From a packing of grains to its circular diagram, in a minute.

Run it with ``python examples/first_probe.py [FOLDER]``; the figure goes to FOLDER (default: here).
"""

import sys
import time

import rendulic as rd


def show(done: float, total: float, note: str = "", _last: list[float] = [0.0]) -> None:  # noqa: B006
    """A progress callback: any function of this form will do."""
    if time.monotonic() - _last[0] > 2.0:
        _last[0] = time.monotonic()
        print(f"  {100 * done / total:3.0f} %  {note}")


def main(folder: str = ".", n_grains: int = 500) -> None:
    # a loose packing at rest under 200 kPa, then drained compression to q/p = 0.4
    sample = rd.dem.pack(n_grains, radius=(2e-3, 18e-3), pressure=200e3, seed=1, progress=show)
    curve = sample.load(rd.paths.drained_triaxial(until_eta=0.4), progress=show)
    print(f"stopped by {curve.attrs['stopped_by']} after {curve.sizes['record']} records: {sample!r}")
    print(sample.equilibrium())

    # 18 directions from that same state, read at two sizes of the strain increment
    probes = rd.probe(sample, rd.directions.rendulic(step=20), norm=[5e-5, 2e-4], progress=show)
    for norm in probes.norm.values:
        one = probes.sel(norm=norm)
        worst = one.isel(alpha=int(one.w2_normalised.argmin("alpha")))
        print(
            f"norm {norm:g}: smallest W2n {float(worst.w2_normalised):+.2f} at {float(worst.alpha):.0f} degrees, "
            f"drift {float(worst.w2_drift):.1e} of {float(worst.w2_macro):.1e} J/m3, "
            f"micro = macro to {float(one.identity_residual.max()):.0e}"
        )
    named = {f"norm {norm:g}": probes.sel(norm=norm) for norm in probes.norm.values}
    print(*rd.figures.save(rd.figures.circular_diagram(named), folder, "first_probe"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
