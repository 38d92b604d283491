"""Figures of results (matplotlib); each function takes labelled data and returns a `Figure`."""

from rendulic.figures.anatomy import anatomy, anatomy_around
from rendulic.figures.anatomy_controls import cluster_controls
from rendulic.figures.bifurcation import bifurcation_map
from rendulic.figures.bursts import burst_table, bursts, equation_1
from rendulic.figures.circular import circular_diagram, circular_diagrams, circular_panels
from rendulic.figures.cones import amplitude, cones
from rendulic.figures.contact_planes import plane_paths, plane_stiffness, plane_work
from rendulic.figures.element import element_tests
from rendulic.figures.forces import forces
from rendulic.figures.lab import path_work
from rendulic.figures.macro_micro import macro_micro
from rendulic.figures.plot import plot
from rendulic.figures.stereogram import stereogram
from rendulic.figures.stress_probes import stress_on_strain
from rendulic.figures.style import save
from rendulic.figures.triaxial import deviatoric_stress, volume_change
from rendulic.figures.work_by_class import work_by_class

__all__ = [
    "amplitude",
    "anatomy",
    "anatomy_around",
    "bifurcation_map",
    "burst_table",
    "bursts",
    "circular_diagram",
    "circular_diagrams",
    "circular_panels",
    "cluster_controls",
    "cones",
    "deviatoric_stress",
    "element_tests",
    "equation_1",
    "forces",
    "macro_micro",
    "path_work",
    "plane_paths",
    "plane_stiffness",
    "plane_work",
    "plot",
    "save",
    "stereogram",
    "stress_on_strain",
    "volume_change",
    "work_by_class",
]
