"""The state of an assembly that has just been made: checked, with its neighbours listed, but no forces yet."""

from __future__ import annotations

from math import isfinite

import numpy as np

from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.state import margins
from rendulic.dem.state.assembly_state import LARGEST_FRACTION, AssemblyState
from rendulic.dem.state.grains import make_grains
from rendulic.dem.state.neighbours import find_contacts
from rendulic.dem.state.placement import make_walls, refuse_deep_overlaps, refuse_outside
from rendulic.foundation.checks import positive_number
from rendulic.foundation.errors import InvalidInput

__all__ = ["made_of"]


def made_of(
    position,
    radius,
    walls,
    density: float,
    law: ContactLaw | None,
    damping: float,
    time_step_fraction: float,
    velocity,
    angular_velocity,
) -> AssemblyState:
    """The state of these grains between these walls; parameters and errors are those of `Assembly`."""
    density = positive_number("density", density, "kg/m3")
    grains, box = make_grains(position, radius, density, velocity, angular_velocity), make_walls(walls)
    refuse_outside(grains, box)
    if not (isfinite(damping) and 0.0 <= damping < 1.0):
        raise InvalidInput(f"damping must be in [0, 1), got {damping!r}")
    if not 0.0 < time_step_fraction < LARGEST_FRACTION:
        raise InvalidInput(f"time_step_fraction must be in (0, {LARGEST_FRACTION}), got {time_step_fraction!r}")
    margin = margins.NEW * float(grains.radius.mean())
    contacts, wall_contacts = find_contacts(grains, box, None, margin)
    refuse_deep_overlaps(grains, contacts)
    return AssemblyState(
        law=LinearFrictional() if law is None else law,
        grains=grains,
        contacts=contacts,
        walls=box,
        wall_contacts=wall_contacts,
        list_origin=grains.position.copy(),
        list_wall_origin=box.position.copy(),
        spent=np.zeros(3),
        strain_origin=box.position[1::2] - box.position[0::2],
        density=density,
        damping=float(damping),
        time_step_fraction=float(time_step_fraction),
        margin=margin,
    )
