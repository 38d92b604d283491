"""The kernels of grains, compiled for a contact law."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from types import SimpleNamespace

from rendulic.dem.kernels import contact_law, lanes, rows, step, sums, team
from rendulic.dem.kernels.layout import LANE, LANE_STACKED
from rendulic.dem.laws import ContactLaw
from rendulic.foundation.compiling import Unbound, bind

__all__ = ["kernels_for", "lane_kernels_for"]

PREFIX = "law_"  # before the name of a law's function, in kernels
OF_A_LAW = tuple(name.removeprefix(PREFIX) for name, thing in vars(contact_law).items() if isinstance(thing, Unbound))


def kernels_for(law: ContactLaw) -> SimpleNamespace:
    """Return `advance`, `finish_step`, `contact_forces`, ... compiled with the functions of `law`."""
    return _bound(*(getattr(law, name) for name in OF_A_LAW))


def lane_kernels_for(law: ContactLaw, width: int) -> SimpleNamespace:
    """Return `advance_lanes`, `finish_lanes`, ... for so many lanes, compiled with the functions of `law`."""
    return _bound(*(getattr(law, name) for name in OF_A_LAW), width=width)


@lru_cache(maxsize=64)  # of those in use; what was compiled is kept beside
def _bound(*functions: Callable, width: int = 0) -> SimpleNamespace:
    meaning = {PREFIX + name: function for name, function in zip(OF_A_LAW, functions, strict=True)}
    if not width:
        return bind((step, team, sums), meaning)
    operations = rows.row_operations(width, fetched=LANE.origin, stacked=LANE_STACKED)
    return bind((lanes,), meaning | {"WIDTH": width, **vars(operations)})
