"""A contact law of your own: Hertz and Coulomb instead of linear springs.

A law is an object with five members; its functions are plain Python that numba can compile. Run it with
``python examples/own_contact_law.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from math import sqrt

from matplotlib import pyplot as plt

import rendulic as rd


@dataclass(frozen=True)
class Hertz:
    """Normal force 4/3 E* sqrt(R*) u^1.5, a linear tangential spring up to Coulomb's limit."""

    modulus: float = 2e9  # E* in Pa
    tangential: float = 1e6  # k_t in N/m
    wall: float = 5e6  # k_n of a grain on a wall in N/m
    friction: float = 0.5

    @property
    def parameters(self):
        return (self.modulus, self.tangential, self.wall, self.friction)

    @staticmethod
    def stiffness(radius_1, radius_2, parameters):
        return 4 / 3 * parameters[0] * sqrt(radius_1 * radius_2 / (radius_1 + radius_2)), parameters[1]

    @staticmethod
    def wall_stiffness(radius, parameters):
        return parameters[2]

    @staticmethod
    def contact_force(overlap, k_n, k_t, force_x, force_y, force_z, slip_x, slip_y, slip_z, parameters):
        force_n = k_n * max(overlap, 0.0) ** 1.5
        x, y, z = force_x - k_t * slip_x, force_y - k_t * slip_y, force_z - k_t * slip_z
        size, limit = sqrt(x * x + y * y + z * z), parameters[3] * force_n
        if size <= limit:
            return force_n, x, y, z, 0.0
        scale = limit / size
        return force_n, scale * x, scale * y, scale * z, (size - limit) * limit / k_t

    @staticmethod
    def elastic_energy(force_n, force_t, k_n, k_t):
        return 0.4 * force_n * (force_n / k_n) ** (2 / 3) + 0.5 * force_t * force_t / k_t


def main(folder: str = ".", n_grains: int = 150) -> None:
    figure, axes = plt.subplots(figsize=(5, 3.5), layout="constrained")
    for name, law in {"linear": rd.dem.LinearFrictional(friction=0.5), "Hertz": Hertz()}.items():
        sample = rd.dem.pack(n_grains, radius=(5e-3, 10e-3), pressure=100e3, seed=1, law=law, growth_friction=0.0)
        curve = sample.load(rd.paths.drained_triaxial(until_strain=0.01))
        print(f"{name:7s} {sample!r}, q = {float(curve.q[-1]) / 1e3:.0f} kPa at 1 %")
        axes.plot(100 * curve.eps_1, curve.q / 1e3, label=name)
    axes.set(xlabel="axial strain, %", ylabel="q, kPa")
    axes.legend()
    print(*rd.figures.save(figure, folder, "own_contact_law"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
