"""Figures of results (matplotlib); each function takes labelled data and returns a `Figure`."""

from rendulic.figures.circular import circular_diagram, circular_diagrams
from rendulic.figures.macro_micro import macro_micro
from rendulic.figures.style import save
from rendulic.figures.triaxial import deviatoric_stress, volume_change

__all__ = [
    "circular_diagram",
    "circular_diagrams",
    "deviatoric_stress",
    "macro_micro",
    "save",
    "volume_change",
]
