"""The cone in all principal directions, not only axisymmetric ones.

Run it with ``python examples/all_directions.py [FOLDER]``.
"""

import sys

import rendulic as rd


def main(folder: str = ".") -> None:
    point = rd.ChangHicher.preset("hostun_loose").at(pressure=300e3, void_ratio=0.9)
    point.load(rd.paths.constant_volume(until_strain=0.03))
    probes = rd.probe(point, rd.directions.sphere(400), norm=1e-6)
    work = probes.w2_normalised
    unstable = float((work < 0).mean())
    worst = int(work.argmin("direction"))
    along = [float(probes[f"along_{k}"][worst]) for k in (1, 2, 3)]
    print(f"{100 * unstable:.1f} % of all directions are unstable; smallest W2n {float(work.min()):+.3f}")
    print("along " + ", ".join(f"{value:+.2f}" for value in along) + " (contraction positive)")
    figure = rd.figures.stereogram(probes, "Loose Hostun sand, undrained, 3 %")
    print(*rd.figures.save(figure, folder, "all_directions"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
