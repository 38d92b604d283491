"""Grains: spheres between six walls, stepped in time."""

from rendulic.dem.assembly import Assembly
from rendulic.dem.drive.quasi_static import QuasiStatic
from rendulic.dem.drive.rest import Rest, bring_to_rest
from rendulic.dem.drive.team import use_threads
from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.measure.equilibrium import Equilibrium
from rendulic.dem.packing import pack

__all__ = [
    "Assembly",
    "ContactLaw",
    "Equilibrium",
    "LinearFrictional",
    "QuasiStatic",
    "Rest",
    "bring_to_rest",
    "pack",
    "use_threads",
]


def __dir__() -> list[str]:
    return __all__
