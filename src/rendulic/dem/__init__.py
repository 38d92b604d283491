"""Grains: spheres between six walls, stepped in time."""

from rendulic.dem.assembly import Assembly
from rendulic.dem.equilibrium import Equilibrium
from rendulic.dem.growth import pack
from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.quasi_static import QuasiStatic
from rendulic.dem.rest import Rest, bring_to_rest
from rendulic.dem.team import use_threads

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
