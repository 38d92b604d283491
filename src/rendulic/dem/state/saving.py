"""An assembly as a `State`, and back. What is saved are the fields of `AssemblyState`, in their order."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, get_type_hints

import numpy as np

from rendulic.dem.laws import LAWS, ContactLaw
from rendulic.dem.state.assembly_state import AssemblyState, copied
from rendulic.dem.state.checking import check_state
from rendulic.foundation.errors import CorruptFile, InvalidInput
from rendulic.specimen.state import State

__all__ = ["law_of", "restore", "state_of"]

KIND = "Assembly"
_types = get_type_hints(AssemblyState)
_saved = {item.name: _types[item.name] for item in fields(AssemblyState) if item.metadata.get("saved", True)}
# to every group its class; the names of the arrays, and of the numbers
GROUPS = {name: kind for name, kind in _saved.items() if issubclass(kind, tuple)}
ARRAYS = tuple(name for name, kind in _saved.items() if kind is np.ndarray)
NUMBERS = tuple(name for name in _saved if name not in GROUPS and name not in ARRAYS)


def state_of(assembly: AssemblyState) -> State:
    """Copy everything that a step depends on, the neighbour list included: its order is that of sums."""
    arrays = {f"{group}/{name}": array.copy() for group in GROUPS
              for name, array in getattr(assembly, group)._asdict().items()}  # fmt: skip
    arrays |= {name: getattr(assembly, name).copy() for name in ARRAYS}
    law = assembly.law
    numbers = {name: getattr(assembly, name) for name in NUMBERS}
    return State(KIND, arrays, {"law": type(law).__name__, "law_fields": _fields(law), **numbers})


def restore(assembly: AssemblyState, state: State) -> None:
    """Put a saved state into `assembly`, in place, exactly."""
    state.expect_kind(KIND)
    check_state(state.arrays, state.attributes)
    whole: dict[str, Any] = {"law": law_of(state, assembly.law)}
    for group, kind in GROUPS.items():
        whole[group] = copied(kind(**{name: state.arrays[f"{group}/{name}"] for name in kind._fields}))
    whole |= {name: state.arrays[name].copy() for name in ARRAYS}
    whole |= {name: state.attributes[name] for name in NUMBERS}
    for name, value in whole.items():
        setattr(assembly, name, value)


def law_of(state: State, given: ContactLaw | None, exactly: bool = False) -> ContactLaw:
    """The contact law that a state names: rendulic's own is made, another one must be `given`.

    With `exactly`, a law given for a state of rendulic's own law must equal the saved one, too.
    """
    state.expect_kind(KIND)
    name, fields = state.attributes.get("law"), state.attributes.get("law_fields", {})
    if not isinstance(name, str) or not isinstance(fields, dict):
        raise CorruptFile(
            f"the state of an assembly must name its contact law and the law's numbers, found {name!r:.80}"
        )
    if name in LAWS and not exactly:
        try:
            return LAWS[name](**fields)
        except (TypeError, InvalidInput) as error:
            raise CorruptFile(f"the state of an assembly has a law that cannot be: {error}") from None
    if given is not None and type(given).__name__ == name:
        if _fields(given) != fields:
            raise InvalidInput(f"the state was saved with {name}({fields}), the law given has {_fields(given)}")
        return given
    raise InvalidInput(
        f"the state was saved with the contact law '{name}': pass that law to from_state(state, law=...)"
    )


def _fields(law: ContactLaw) -> dict[str, Any]:
    return {name: getattr(law, name) for name in getattr(law, "__dataclass_fields__", {})}
