"""Sums over all contacts that are taken now and then, not in every step."""

from __future__ import annotations

from rendulic.dem.kernels.contact_law import law_elastic_energy, law_stiffness, law_wall_stiffness
from rendulic.dem.kernels.contacts import tangential_force
from rendulic.dem.kernels.layout import CONTACT, GRAIN
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
        largest = max(largest, row[i, GRAIN.radius])
    for c in range(contacts.first.shape[0]):
        if contacts.force[c, CONTACT.force_n] > 0.0:
            i, j = contacts.first[c], contacts.second[c]
            k_n, k_t = law_stiffness(row[i, GRAIN.radius], row[j, GRAIN.radius], parameters)
            stiffest = max(k_n, k_t / SHEAR_RATIO)
            sums[i] += stiffest
            sums[j] += stiffest
    for c in range(wall_contacts.grain.shape[0]):
        if wall_contacts.force[c] > 0.0:
            i = wall_contacts.grain[c]
            sums[i] += law_wall_stiffness(row[i, GRAIN.radius], parameters)
    for i in range(row.shape[0]):
        k_n, k_t = law_stiffness(row[i, GRAIN.radius], largest, parameters)
        sums[i] = max(sums[i], k_n, k_t / SHEAR_RATIO)


@kernel
def stored_energy(grains, contacts, wall_contacts, parameters):
    """Elastic energy of all closed contacts, walls included."""
    row = grains.row
    total = 0.0
    for c in range(contacts.first.shape[0]):
        if contacts.force[c, CONTACT.force_n] > 0.0:
            k_n, k_t = law_stiffness(
                row[contacts.first[c], GRAIN.radius], row[contacts.second[c], GRAIN.radius], parameters
            )
            tangential = tangential_force(contacts.force, c)
            total += law_elastic_energy(contacts.force[c, CONTACT.force_n], tangential, k_n, k_t)
    for c in range(wall_contacts.grain.shape[0]):
        if wall_contacts.force[c] > 0.0:
            k_n = law_wall_stiffness(row[wall_contacts.grain[c], GRAIN.radius], parameters)
            total += law_elastic_energy(wall_contacts.force[c], 0.0, k_n, k_n)
    return total
