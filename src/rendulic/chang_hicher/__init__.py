"""The microstructural model of Chang and Hicher: contact planes, undrained sand, local and global instability."""

from rendulic.chang_hicher.drive.batch import load_many
from rendulic.chang_hicher.law import plane_law
from rendulic.chang_hicher.law.parameters import PRESETS, Parameters, material
from rendulic.chang_hicher.measure.failure_modes import (
    Stability,
    Tangent,
    closed_form_cone,
    plane_stiffness,
    stability,
    tangent,
)
from rendulic.chang_hicher.model import ChangHicher
from rendulic.chang_hicher.point import MaterialPoint

__all__ = [
    "PRESETS",
    "ChangHicher",
    "MaterialPoint",
    "Parameters",
    "Stability",
    "Tangent",
    "closed_form_cone",
    "load_many",
    "material",
    "plane_law",
    "plane_stiffness",
    "stability",
    "tangent",
]
