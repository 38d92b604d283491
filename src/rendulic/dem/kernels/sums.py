"""Sums over all contacts that are taken now and then, not in every step."""

from __future__ import annotations

from math import sqrt

from rendulic.dem.kernels.arrays import RADIUS
from rendulic.dem.kernels.contact_law import law_elastic_energy, law_stiffness, law_wall_stiffness
from rendulic.foundation.compiling import kernel

SHEAR_RATIO = 0.42  # k_t / k_n up to which normal stiffness decides the time step


@kernel
def stiffness_sums(grains, contacts, wall_contacts, parameters, sums):
    """Sum the stiffnesses of each grain's closed contacts, walls included, into `sums` (n,).

    A contact counts with `k_n`, or with `k_t / 0.42` if that is more: the stability of two grains that
    shear against each other depends on `k_t`. A sum is at least one contact with the largest grain.
    """
    row = grains.row
    largest = 0.0
    for i in range(row.shape[0]):
        sums[i] = 0.0
        largest = max(largest, row[i, RADIUS])
    for c in range(contacts.first.shape[0]):
        if contacts.force[c, 0] > 0.0:
            i, j = contacts.first[c], contacts.second[c]
            k_n, k_t = law_stiffness(row[i, RADIUS], row[j, RADIUS], parameters)
            stiffest = max(k_n, k_t / SHEAR_RATIO)
            sums[i] += stiffest
            sums[j] += stiffest
    for c in range(wall_contacts.grain.shape[0]):
        if wall_contacts.force[c] > 0.0:
            i = wall_contacts.grain[c]
            sums[i] += law_wall_stiffness(row[i, RADIUS], parameters)
    for i in range(row.shape[0]):
        k_n, k_t = law_stiffness(row[i, RADIUS], largest, parameters)
        sums[i] = max(sums[i], k_n, k_t / SHEAR_RATIO)


@kernel
def stored_energy(grains, contacts, wall_contacts, parameters):
    """Elastic energy of all closed contacts, walls included."""
    row = grains.row
    total = 0.0
    for c in range(contacts.first.shape[0]):
        if contacts.force[c, 0] > 0.0:
            k_n, k_t = law_stiffness(row[contacts.first[c], RADIUS], row[contacts.second[c], RADIUS], parameters)
            tangential = sqrt(contacts.force[c, 1] ** 2 + contacts.force[c, 2] ** 2 + contacts.force[c, 3] ** 2)
            total += law_elastic_energy(contacts.force[c, 0], tangential, k_n, k_t)
    for c in range(wall_contacts.grain.shape[0]):
        if wall_contacts.force[c] > 0.0:
            k_n = law_wall_stiffness(row[wall_contacts.grain[c], RADIUS], parameters)
            total += law_elastic_energy(wall_contacts.force[c], 0.0, k_n, k_n)
    return total
