"""Making a packing: grains grow among each other to an isotropic pressure."""

from __future__ import annotations

import numpy as np

from rendulic.dem.assembly import Assembly
from rendulic.dem.drive.growth import grow_to_rest, with_friction
from rendulic.dem.drive.quasi_static import QuasiStatic
from rendulic.dem.kernels.insertion import insert_spheres
from rendulic.dem.laws import ContactLaw, LinearFrictional
from rendulic.dem.state.assembly_state import DAMPING, DENSITY
from rendulic.foundation.checks import finite_array, positive_number, whole_number
from rendulic.foundation.errors import DidNotConverge, InvalidInput
from rendulic.foundation.progress import Progress, silent

__all__ = ["PRESSURE", "RADII", "check_pressure", "pack"]

RADII = (2e-3, 18e-3)  # m, of a packing if nothing else is said
PRESSURE = 200e3  # Pa, the same
LOOSE_FRACTION = 0.25  # solid fraction of the random places from which growth starts
SMALLEST_OVERLAP, LARGEST_OVERLAP = 1e-7, 0.02  # of a diameter, for the mean force p d^2 on the mean grain


def pack(
    n_grains: int | None = None,
    radius=RADII,
    pressure: float = PRESSURE,
    *,
    seed: int = 0,
    law: ContactLaw | None = None,
    density: float = DENSITY,
    growth_friction: float | None = None,
    porosity: float | None = None,
    speed: QuasiStatic | None = None,
    probe_damping: float = DAMPING,
    progress: Progress = silent,
) -> Assembly:
    """Make a cubical packing at rest under an isotropic pressure (paper, section 4.1).

    1. Grains at random places of a cube, small enough not to touch.
    2. Their radii grow at a bounded rate, friction on, until the walls feel the pressure.
    3. The walls hold the pressure while the radii finish growing to the values drawn.
    4. With `porosity`, friction is lowered at constant pressure until the packing is that dense.
    5. Friction takes its final value; rest at constant stress.

    Parameters
    ----------
    n_grains : int
        Number of grains; may be omitted when `radius` is an array of all radii.
    radius : (smallest, largest) or array
        Bounds of a uniform distribution, or all radii, in m.
    pressure : float
        Isotropic pressure in Pa.
    seed : int
        Of radii and places; the same seed gives the same packing.
    growth_friction : float, optional
        Friction during growth; by default that of the law (a loose packing). Smaller gives denser.
    porosity : float, optional
        Target, at most what growth gives; the packing is densified to within 0.001.
    speed : QuasiStatic, optional
        Damping, rates and equilibrium criterion of the preparation.
    probe_damping : float
        Damping of the returned assembly.

    Raises
    ------
    InvalidInput
        For numbers that make no packing, or a pressure that would press the grains flat.
    DidNotConverge
        If the pressure or the porosity cannot be reached; the message says how far it came.
    """
    law = LinearFrictional() if law is None else law
    speed = speed or QuasiStatic()
    pressure = positive_number("pressure", pressure, "Pa")
    seed = whole_number("seed", seed, 0)
    radii = _draw_radii(n_grains, radius, seed)
    check_pressure(pressure, float(radii.mean()), law)
    if porosity is not None and not 0.2 < porosity < 0.6:
        raise InvalidInput(f"a target porosity must lie between 0.2 and 0.6, got {porosity!r}")
    growth_friction = law.friction if growth_friction is None else growth_friction
    growing = with_friction(law, growth_friction)

    # a cube in which the pressure builds up just before the radii are final
    expected = 0.40 + 0.03 * min(growth_friction / 0.7, 1.0)
    solid = float((4.0 / 3.0 * np.pi * radii**3).sum())
    length = (solid / (1.0 - expected)) ** (1.0 / 3.0)
    start = (LOOSE_FRACTION * length**3 / solid) ** (1.0 / 3.0)
    position, placed = insert_spheres(radii * start, length, seed, 100_000)
    if placed < len(radii):
        raise DidNotConverge(
            f"only {placed} of {len(radii)} grains found a place: the largest radius ({radii[0]:.3g} m) is too large "
            f"for a cube of {length:.3g} m; use more grains or a narrower range of radii"
        )
    box = np.array([0.0, length] * 3)
    assembly = Assembly(position, radii * start, box, density=density, law=growing, damping=probe_damping)
    grow_to_rest(assembly, 1.0 / start, law, pressure, porosity, speed, progress)
    return assembly


def _draw_radii(n_grains: int | None, radius, seed: int) -> np.ndarray:
    """Radii from large to small."""
    values = finite_array("radius", radius, (None,))
    if (values <= 0.0).any():
        raise InvalidInput(f"radii must be positive, got {values.min():.3g} m")
    if n_grains is None:
        if len(values) < 20:
            raise InvalidInput(f"give n_grains, or at least 20 radii; got {len(values)} radii")
        return np.sort(values)[::-1].copy()
    n_grains = whole_number("n_grains", n_grains, 20)
    if len(values) != 2 or values[0] > values[1]:
        raise InvalidInput(f"radius must be (smallest, largest) when n_grains is given, got {values.tolist()}")
    drawn = np.random.default_rng(seed).uniform(values[0], values[1], int(n_grains))
    return np.sort(drawn)[::-1].copy()


def check_pressure(pressure: float, mean: float, law: ContactLaw) -> None:
    """Raise `InvalidInput` for a pressure in Pa that would press grains of this mean radius in m flat, or press nothing.

    Contacts are points in this mechanics.
    """
    stiffness, _ = law.stiffness(mean, mean, law.parameters)
    scale = stiffness / (2.0 * mean)
    if not SMALLEST_OVERLAP * scale <= pressure <= LARGEST_OVERLAP * scale:
        raise InvalidInput(
            f"a pressure of {pressure:.4g} Pa is unreachable with these contacts: mean overlaps must stay between "
            f"{SMALLEST_OVERLAP:g} and {LARGEST_OVERLAP:g} of a diameter, that is {SMALLEST_OVERLAP * scale:.4g} to "
            f"{LARGEST_OVERLAP * scale:.4g} Pa; change the pressure or the stiffness"
        )
