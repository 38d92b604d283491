"""An assembly as a `State`, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rendulic.dem.kernels.arrays import Contacts, Grains, WallContacts, Walls, aligned_rows, servo_room
from rendulic.dem.laws import LAWS, ContactLaw
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.specimen.state import State

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["law_of", "restore", "state_of"]

KIND = "Assembly"
GROUPS = ("grains", "contacts", "walls", "wall_contacts")
ARRAYS = ("list_origin", "list_wall_origin", "spent", "strain_origin")
NUMBERS = (
    "density",
    "damping",
    "inertial_radius",
    "time_step_fraction",
    "time_step",
    "has_fixed_time_step",
    "time",
    "n_steps",
    "n_rebuilds",
    "margin",
    "steps_since_build",
    "growth_since_build",
)


def state_of(assembly: Assembly) -> State:
    """Copy everything that a step depends on, the neighbour list included: its order is that of sums."""
    arrays = {f"{group}/{name}": array.copy() for group in GROUPS
              for name, array in getattr(assembly, group)._asdict().items()}  # fmt: skip
    arrays |= {name: getattr(assembly, name).copy() for name in ARRAYS}
    law = assembly.law
    numbers = {name: getattr(assembly, name) for name in NUMBERS}
    return State(KIND, arrays, {"law": type(law).__name__, "law_fields": _fields(law), **numbers})


def restore(assembly: Assembly, state: State) -> None:
    """Put a saved state into `assembly`, in place, exactly."""
    state.expect_kind(KIND)
    law = law_of(state, assembly.law)
    try:
        groups = {group: {key.partition("/")[2]: array.copy() for key, array in state.arrays.items()
                          if key.startswith(f"{group}/")} for group in GROUPS}  # fmt: skip
        rows = aligned_rows(groups["grains"]["row"])
        whole = {
            "law": law,
            "grains": Grains(rows, groups["grains"]["mass"], groups["grains"]["inertia"]),
            "contacts": Contacts(**groups["contacts"]),
            "walls": Walls(**groups["walls"]),
            "wall_contacts": WallContacts(**groups["wall_contacts"]),
            **{name: state.arrays[name].copy() for name in ARRAYS},
            **{name: state.attributes[name] for name in NUMBERS},
            "_scratch": servo_room(),
        }
    except (KeyError, TypeError) as error:
        raise CorruptFile(f"the state lacks what an assembly of this version needs: {error}") from None
    for name, value in whole.items():
        setattr(assembly, name, value)


def law_of(state: State, given: ContactLaw | None, exactly: bool = False) -> ContactLaw:
    """The contact law that a state names: rendulic's own is made, another one must be `given`.

    With `exactly`, a law given for a state of rendulic's own law must equal the saved one, too.
    """
    state.expect_kind(KIND)
    name, fields = state.attributes.get("law"), state.attributes.get("law_fields", {})
    if name in LAWS and not exactly:
        return LAWS[name](**fields)
    if given is not None and type(given).__name__ == name:
        if _fields(given) != fields:
            raise InvalidInput(f"the state was saved with {name}({fields}), the law given has {_fields(given)}")
        return given
    raise InvalidInput(
        f"the state was saved with the contact law '{name}': pass that law to from_state(state, law=...)"
    )


def _fields(law: ContactLaw) -> dict[str, Any]:
    return {name: getattr(law, name) for name in getattr(law, "__dataclass_fields__", {})}
