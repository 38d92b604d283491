"""Whether the arrays and numbers of a saved point can be those of one: before a kernel sees them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rendulic.chang_hicher.drive.virgin import LARGEST_VOID_RATIO
from rendulic.chang_hicher.state import ARRAYS, N
from rendulic.foundation.errors import CorruptFile
from rendulic.specimen.fields import Fields

__all__ = ["check_state"]

WHERE = "the state of a Chang-Hicher point"
MODEL = ("parameters", "formulation", "rule", "rule_degree")
MOST_PLANES = 100_000


def check_state(arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any]) -> None:
    """Refuse what cannot be the state of a point: missing, of another type or shape, not finite, of an impossible sign.

    Parameters of the model are checked where it is made of them.

    Raises
    ------
    CorruptFile
        Naming the field, the row, and what was expected.
    """
    fields = Fields(WHERE, arrays, attributes)
    fields.expect_names([*ARRAYS, "plane_normals", "plane_weights"], [*MODEL, "void_ratio_0"], optional=["fabric"])
    n = len(fields.array("plane_normals", np.float64, (None, 3)))
    if not 0 < n <= MOST_PLANES:
        raise CorruptFile(f"{WHERE}: plane_normals must have 1 to {MOST_PLANES} rows, found {n}")
    fields.refuse("plane_normals", np.abs(arrays["plane_normals"]) > 1.0 + 1e-6, "a unit vector")
    fields.array("plane_weights", np.float64, (n,))
    for name, shape in ARRAYS.items():
        fields.array(name, np.float64, tuple(n if k == N else k for k in shape))
    if "fabric" in arrays:
        fields.array("fabric", np.float64, (3, 3))
    fields.refuse("memory", arrays["memory"] < 0.0, "zero or more")
    if not arrays["sigma"][:3].sum() > 0.0:
        raise CorruptFile(f"{WHERE}: sigma must be of positive mean stress, found {arrays['sigma'].tolist()}")
    if fields.number("void_ratio_0", above=0.0) > LARGEST_VOID_RATIO:
        raise CorruptFile(f"{WHERE}: void_ratio_0 must be at most {LARGEST_VOID_RATIO:g}")
    fields.count("rule_degree")
    for name, kind, what in (
        ("formulation", str, "a name"),
        ("rule", str, "a name"),
        ("parameters", dict, "names and numbers"),
    ):
        if not isinstance(attributes[name], kind):
            raise CorruptFile(f"{WHERE}: {name} must be {what}, found {str(attributes[name])[:80]!r}")
