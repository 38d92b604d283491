"""Does a packing fail, if disturbed under a held load? Kinetic energy tells.

A state is pushed along two directions and then left to itself under the load conjugate to each. Run it with
``python examples/held_load.py [FOLDER]``.
"""

import sys

import rendulic as rd


def main(folder: str = ".", n_grains: int = 400) -> None:
    sample = rd.dem.pack(n_grains, radius=(4e-3, 12e-3), pressure=200e3, seed=2)
    sample.load(rd.paths.drained_triaxial(until_eta=0.55))
    rd.dem.bring_to_rest(sample, "stress")
    curves = {}
    for alpha in (35.3, 125.3):
        curve = rd.burst(sample, alpha, norm=2e-4)
        curves[f"{alpha:g}"] = curve
        print(f"{alpha:5.1f} degrees (R = {curve.attrs['ratio']:+.2f}): {curve.attrs['verdict']}")
        print(
            f"  kinetic energy reaches {curve.attrs['kinetic_share']:.1e} of the stored energy; energy is kept to {curve.attrs['balance_error']:.0e}"
        )
    print(*rd.figures.save(rd.figures.bursts(curves, "eta = 0.55"), folder, "held_load"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
