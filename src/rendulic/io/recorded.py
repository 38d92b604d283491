"""What files say of an engine's own numbers, checked: shared by the neutral file and plain text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Literal

from rendulic.foundation.validation import Positive, Section, Whole, validated
from rendulic.specimen.recorded import Recorded, Springs

__all__ = ["ARRAYS", "SaidSprings", "recorded_from", "said_of"]

# shapes; a first None is the number of grains
ARRAYS: dict[str, tuple[int | None, ...]] = {
    "wall_force": (6,), "grain_force": (None, 3), "grain_moment": (None, 3), "stress": (3, 3), "slack": (None,),
}  # fmt: skip


class SaidSprings(Section):
    """The linear normal law: see `specimen.recorded.Springs`."""

    modulus: Positive
    rule: Literal["mean_diameter", "harmonic"]
    wall_modulus: Positive | None = None

    def springs(self) -> Springs:
        """The springs of a snapshot."""
        return Springs(self.modulus, self.rule, self.wall_modulus)


class Said(Section):
    """What is no array."""

    springs: SaidSprings | None = None
    stress_of_pairs: bool = False
    are_spheres: bool | None = None
    step: Whole | None = None
    n_merged: Whole = 0
    derived: tuple[Literal["normal", "force_t"], ...] = ()


def said_of(recorded: Recorded) -> dict[str, Any]:
    """What is no array, as JSON and TOML can hold it."""
    return {name: value for name, value in asdict(recorded).items() if name not in ARRAYS and value is not None}


def recorded_from(said: Any, arrays: Mapping[str, Any], what: str) -> Recorded:
    """The engine's own numbers from a table and arrays of a file.

    Raises
    ------
    InvalidInput
        Naming `what`, the entry and what was expected.
    """
    table = validated(Said, said, what)
    springs = None if table.springs is None else table.springs.springs()
    return Recorded(**arrays, **(dict(table) | {"springs": springs}))
