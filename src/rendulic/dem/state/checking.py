"""Whether the arrays and numbers of a saved assembly can be those of one: before a kernel sees them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rendulic.dem.kernels.layout import GRAIN, N_CONTACT, N_GRAIN
from rendulic.dem.state.assembly_state import LARGEST_FRACTION
from rendulic.dem.state.grains import sphere_masses
from rendulic.foundation.errors import CorruptFile
from rendulic.specimen.fields import Fields

__all__ = ["check_state"]

WHERE = "the state of an assembly"
SAME = 1e-9  # relative
LARGEST_MARGIN = 1.0  # of the mean radius; the engine's own are 0.02 to 0.3
# n grains, c candidate pairs, w candidates at walls
ARRAYS: dict[str, tuple[type, tuple[int | str, ...]]] = {
    "grains/row": (np.float64, ("n", N_GRAIN)),
    "grains/mass": (np.float64, ("n",)),
    "grains/inertia": (np.float64, ("n",)),
    "contacts/first": (np.int32, ("c",)),
    "contacts/second": (np.int32, ("c",)),
    "contacts/force": (np.float64, ("c", N_CONTACT)),
    "walls/position": (np.float64, (6,)),
    "walls/force": (np.float64, (6,)),
    "walls/stiffness": (np.float64, (6,)),
    "wall_contacts/grain": (np.int32, ("w",)),
    "wall_contacts/wall": (np.int32, ("w",)),
    "wall_contacts/force": (np.float64, ("w",)),
    "list_origin": (np.float64, ("n", 3)),
    "list_wall_origin": (np.float64, (6,)),
    "spent": (np.float64, (3,)),
    "strain_origin": (np.float64, (3,)),
}
NUMBERS = (
    "density", "damping", "inertial_radius", "time_step_fraction", "time_step", "has_fixed_time_step", "time", "n_steps",
    "n_rebuilds", "margin", "steps_since_build", "growth_since_build", "law", "law_fields",
)  # fmt: skip


def check_state(arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any]) -> None:
    """Refuse what cannot be the state of an assembly.

    1. Every array is there, of its type and shape, and finite; lists that belong together are of one length.
    2. Pairs name grains that are there, each once, in the order of the lists; so do grains at walls.
    3. Radii, masses, lengths of the box and the time step are positive, damping is 0 to 1, stiffness is not negative.
    4. Grains are within the box.

    The contact law is checked where it is made: see `saving.law_of`.

    Raises
    ------
    CorruptFile
        Naming the field, the row, and what was expected.
    """
    fields = Fields(WHERE, arrays, attributes)
    fields.expect_names(ARRAYS, NUMBERS)
    lengths: dict[str, int] = {}
    for name, (dtype, shape) in ARRAYS.items():
        found = fields.array(name, dtype, tuple(lengths.get(k) if isinstance(k, str) else k for k in shape))
        if isinstance(shape[0], str):
            lengths[shape[0]] = len(found)
    _check_numbers(fields, arrays)
    _check_grains(fields, arrays)
    _check_pairs(fields, arrays)


def _check_numbers(fields: Fields, arrays: Mapping[str, np.ndarray]) -> None:
    for name in ("density", "time_step"):
        fields.number(name, above=0.0)
    fields.number("damping", least=0.0, below=1.0)
    fields.number("time_step_fraction", above=0.0, below=LARGEST_FRACTION)
    for name in ("inertial_radius", "growth_since_build", "time"):
        fields.number(name, least=0.0)
    for name in ("n_steps", "n_rebuilds", "steps_since_build"):
        fields.count(name)
    fields.flag("has_fixed_time_step")


def _check_grains(fields: Fields, arrays: Mapping[str, np.ndarray]) -> None:
    rows, walls = arrays["grains/row"], arrays["walls/position"]
    if not len(rows):
        raise CorruptFile(f"{WHERE}: grains/row must have a row for each grain, found none")
    radius = rows[:, GRAIN.radius]
    fields.refuse("grains/row", radius <= 0.0, "a positive radius")
    for name in ("grains/mass", "grains/inertia", "strain_origin"):
        fields.refuse(name, arrays[name] <= 0.0, "a positive number")
    expected = sphere_masses(radius.copy(), fields.number("density"), fields.number("inertial_radius"))
    for name, own in zip(("grains/mass", "grains/inertia"), expected, strict=True):
        fields.refuse(name, ~(np.abs(arrays[name] - own) <= SAME * own), "that of a sphere of this radius and density")
    fields.refuse("walls/stiffness", arrays["walls/stiffness"] < 0.0, "zero or more")
    for name in ("walls/position", "list_wall_origin"):
        shut = np.repeat(arrays[name][1::2] <= arrays[name][0::2], 2)
        fields.refuse(name, shut, "each upper wall above its lower wall")
    margin = fields.number("margin", above=0.0, below=LARGEST_MARGIN * float(radius.mean()))
    for name, position, box in (
        ("grains/row", rows[:, GRAIN.position : GRAIN.position + 3], walls),
        ("list_origin", arrays["list_origin"], arrays["list_wall_origin"]),
    ):
        outside = (position < box[0::2] - margin) | (position > box[1::2] + margin)
        fields.refuse(name, outside, "the centre of a grain within the walls")


def _check_pairs(fields: Fields, arrays: Mapping[str, np.ndarray]) -> None:
    n = len(arrays["grains/row"])
    first, second = arrays["contacts/first"], arrays["contacts/second"]
    grain, wall = arrays["wall_contacts/grain"], arrays["wall_contacts/wall"]
    fields.refuse("contacts/first", (first < 0) | (first >= n), f"a grain, 0 to {n - 1}")
    fields.refuse("contacts/second", second >= n, f"a grain, 0 to {n - 1}")
    fields.refuse("contacts/second", second <= first, "a grain after the first")
    fields.refuse("wall_contacts/grain", (grain < 0) | (grain >= n), f"a grain, 0 to {n - 1}")
    fields.refuse("wall_contacts/wall", (wall < 0) | (wall > 5), "a wall, 0 to 5")
    for name, major, minor, order in (
        ("contacts/first", first, second, "pairs sorted by both grains, each once"),
        ("wall_contacts/wall", wall, grain, "contacts sorted by wall and grain, each once"),
    ):
        if len(major):
            place = major.astype(np.int64) * n + minor
            fields.refuse(name, np.diff(place, prepend=place[0] - 1) <= 0, order)
