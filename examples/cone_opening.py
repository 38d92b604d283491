"""How the unstable cone opens as a sand is sheared.

The same call serves packings of grains; the model takes seconds. Run it with
``python examples/cone_opening.py [FOLDER]``.
"""

import sys

import numpy as np

import rendulic as rd

PATHS = {"drained": rd.paths.drained_triaxial, "undrained": rd.paths.constant_volume}


def main(folder: str = ".") -> None:
    sand = rd.ChangHicher.preset("hostun_loose")
    maps = {}
    for name, path in PATHS.items():
        point = sand.at(pressure=300e3, void_ratio=0.9)
        states = rd.states_along(point, lambda eta, path=path: path(0.5, until_eta=eta), np.arange(0.8, 1.06, 0.05))
        maps[name] = rd.bifurcation_map(states, norm=1e-6, tolerance=0.05)
        print(f"{name}: the cone opens at eta = {float(maps[name].first_eta.min()):.3f}")
    print(*rd.figures.save(rd.figures.bifurcation_map(maps, "Loose Hostun sand, 300 kPa"), folder, "cone_opening"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
