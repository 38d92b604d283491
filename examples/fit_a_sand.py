"""Your own sand: parameters from a drained triaxial test, and the undrained test they predict.

The "measured" test is made here, with other parameters and a scatter of 1 %, so that the answer is known. Run it with
``python examples/fit_a_sand.py [FOLDER]``.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from scipy.optimize import least_squares

import rendulic as rd
from rendulic.io.lab import read_triaxial

PRESSURE, VOID_RATIO = 200e3, 0.85
TRUE = {"k_pR": 0.6, "tan_phi_mu": 0.58}
HEADINGS = {"eps_1": "axial strain", "eps_v": "volumetric strain", "q": "q", "p": "p"}
UNITS = {"eps_1": "%", "eps_v": "%", "q": "kPa", "p": "kPa"}


def drained(**parameters):
    point = rd.ChangHicher(**parameters).at(PRESSURE, VOID_RATIO)
    return point.load(rd.paths.drained_triaxial(until_strain=0.1))


def measured(path: Path) -> None:
    """A CSV file such as a laboratory writes: engineering strains in %, stresses in kPa."""
    curve = drained(**TRUE)
    scatter = np.random.default_rng(1).normal(1.0, 0.01, curve.sizes["record"])
    q = curve.q / 1e3 * scatter
    strains = [-100 * np.expm1(-curve[name]) for name in ("eps_1", "eps_v")]
    rows = np.column_stack((*strains, q, PRESSURE / 1e3 + q / 3))
    np.savetxt(path, rows[::3], delimiter=",", header=",".join(HEADINGS.values()), comments="", fmt="%.5f")


def main(folder: str = ".") -> None:
    file = Path(folder) / "drained.csv"
    measured(file)
    test = read_triaxial(file, HEADINGS, UNITS, drainage="drained")

    def misfit(values):
        """Of q relative to its largest, and of volumetric strain, at the test's own axial strains."""
        curve = drained(k_pR=values[0], tan_phi_mu=values[1])
        q, eps_v = (np.interp(test.eps_1, curve.eps_1, curve[name]) for name in ("q", "eps_v"))
        return np.concatenate(((q - test.q) / float(test.q.max()), (eps_v - test.eps_v) / float(abs(test.eps_v).max())))

    found = least_squares(misfit, [1.0, 0.65], bounds=([0.2, 0.4], [3.0, 0.9]), x_scale=[0.5, 0.1], diff_step=1e-4)
    fitted = dict(zip(TRUE, found.x.tolist(), strict=True))
    print("fitted " + ", ".join(f"{name} = {value:.3f} (true {TRUE[name]:g})" for name, value in fitted.items()))

    point = rd.ChangHicher(**fitted).at(PRESSURE, VOID_RATIO)
    undrained = point.load(rd.paths.constant_volume(until_strain=0.1))
    lost = undrained.event_kind.values == "w2_lost"
    for eta, strain in zip(undrained.event_eta.values[lost], undrained.event_eps_1.values[lost], strict=True):
        print(f"undrained, it becomes unstable at eta = {eta:.3f}, axial strain {100 * strain:.2f} %")
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.5), layout="constrained")
    left.plot(100 * test.eps_1, test.q / 1e3, ".", label="measured, drained")
    for name, curve in {"fitted": drained(**fitted), "predicted, undrained": undrained}.items():
        left.plot(100 * curve.eps_1, curve.q / 1e3, label=name)
    left.set(xlabel="axial strain, %", ylabel="q, kPa")
    left.legend()
    right.plot(undrained.p / 1e3, undrained.q / 1e3, "C1")
    right.plot(undrained.event_p[lost] / 1e3, undrained.event_q[lost] / 1e3, "ko", label="W2 = 0")
    right.set(xlabel="p', kPa", ylabel="q, kPa")
    right.legend()
    print(*rd.figures.save(figure, folder, "fit_a_sand"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
