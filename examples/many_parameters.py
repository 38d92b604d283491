"""Which parameters decide when an undrained sand becomes unstable?

A thousand tests in seconds. Run it with ``python examples/many_parameters.py [FOLDER]``.
"""

import sys

import numpy as np
from matplotlib import pyplot as plt

import rendulic as rd


def main(folder: str = ".", n_sets: int = 1000) -> None:
    draw = np.random.default_rng(1)
    sets = {"k_pR": draw.uniform(0.5, 2.0, n_sets), "dilatancy": draw.uniform(0.6, 1.6, n_sets)}
    tests = rd.ChangHicher.load_many(sets, rd.paths.constant_volume(until_strain=0.1), pressure=300e3, void_ratio=0.9)
    # where no peak is found, q only rises: stable all the way
    is_stable = tests.q_peak.isnull()
    print(f"{n_sets} undrained tests; {int(is_stable.sum())} of them have no peak")
    print(f"q at the peak: {float(tests.q_peak.min()) / 1e3:.0f} to {float(tests.q_peak.max()) / 1e3:.0f} kPa")
    eta = tests.q_peak / tests.p_peak
    print(f"stress ratio there: {float(eta.min()):.3f} to {float(eta.max()):.3f}")

    figure, axes = plt.subplots(1, 2, figsize=(8, 3.5), sharey=True, layout="constrained")
    for one, (name, values) in zip(axes, sets.items(), strict=True):
        one.scatter(values, eta, s=4)
        one.set_xlabel(name)
    axes[0].set_ylabel("stress ratio at which W2 vanishes")
    print(*rd.figures.save(figure, folder, "many_parameters"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
