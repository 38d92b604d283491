"""One unit of work: what it is, what it needs, and the hash by which its result is found again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from rendulic import __version__
from rendulic.foundation.errors import InvalidInput

__all__ = ["RESULTS", "Unit", "check_order", "key_of"]

RESULTS = 4  # raised with every change of results: those of older versions are then not found again


@dataclass(frozen=True, eq=False)
class Unit:
    """Work whose result is one file.

    Parameters
    ----------
    kind : str
        Which work, the name of a `Task`.
    label : str
        For people; not part of the hash.
    inputs : dict
        All numbers and names that the result depends on, as JSON can hold them.
    needs : dict of str to Unit
        Units whose results it starts from, by the part they play.
    """

    kind: str
    label: str
    inputs: Mapping[str, Any] = field(repr=False)
    needs: Mapping[str, Unit] = field(default_factory=dict, repr=False)

    @cached_property
    def key(self) -> str:
        """32 hexadecimal digits of a hash over kind, inputs and what it needs, all the way up."""
        return key_of(self.kind, self.inputs, {role: unit.key for role, unit in self.needs.items()})

    def order(self) -> dict[str, Any]:
        """All that a worker must know, as JSON can hold it."""
        return {
            "rendulic": __version__, "results": RESULTS, "key": self.key, "kind": self.kind, "label": self.label,
            "inputs": dict(self.inputs), "needs": {role: unit.key for role, unit in self.needs.items()},
        }  # fmt: skip


def key_of(kind: str, inputs: Mapping[str, Any], needs: Mapping[str, str], results: int = RESULTS) -> str:
    """The hash of a unit of this kind; equal for equal numbers, whatever their order.

    >>> key_of("state", {"eta": 0.3}, {}) == key_of("state", {"eta": 0.4}, {})
    False
    """
    text = json.dumps([results, kind, inputs, needs], sort_keys=True, allow_nan=False, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def check_order(order: Mapping[str, Any]) -> None:
    """Raise `InvalidInput` if an order comes from another version of rendulic: results of one study are of one version."""
    if (order["rendulic"], order["results"]) != (__version__, RESULTS):
        raise InvalidInput(
            f"this worker runs rendulic {__version__} (results {RESULTS}), the study rendulic {order['rendulic']} (results "
            f"{order['results']}): install the same version everywhere"
        )
