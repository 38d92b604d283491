"""Figures of results (matplotlib); each function takes labelled data and returns a `Figure`."""

from rendulic.figures.circular import circular_diagram, circular_diagrams, circular_panels
from rendulic.figures.contact_planes import plane_paths, plane_stiffness, plane_work
from rendulic.figures.element import element_tests
from rendulic.figures.macro_micro import macro_micro
from rendulic.figures.stereogram import stereogram
from rendulic.figures.style import save
from rendulic.figures.triaxial import deviatoric_stress, volume_change

__all__ = [
    "circular_diagram",
    "circular_diagrams",
    "circular_panels",
    "deviatoric_stress",
    "element_tests",
    "macro_micro",
    "plane_paths",
    "plane_stiffness",
    "plane_work",
    "save",
    "stereogram",
    "volume_change",
]
