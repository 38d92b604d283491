"""Which class a saved state belongs to; a new kind of specimen has one entry here."""

from __future__ import annotations

from importlib import import_module

from rendulic.foundation.errors import one_of
from rendulic.specimen.protocol import Specimen
from rendulic.specimen.state import State

__all__ = ["CLASSES", "specimen_of"]

CLASSES = {
    "Assembly": "rendulic.dem.assembly:Assembly",
    "Chang-Hicher point": "rendulic.chang_hicher.point:MaterialPoint",
}


def specimen_of(state: State) -> Specimen:
    """The specimen in a saved state.

    Raises
    ------
    InvalidInput
        If the state is of an unknown kind, or of grains whose contact law is a user's.
    CorruptFile
        If something is missing or impossible in it.
    """
    module, _, name = CLASSES[one_of(state.kind, CLASSES, "kind of state")].partition(":")
    return getattr(import_module(module), name).from_state(state)
