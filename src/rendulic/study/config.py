"""What a study of a grain assembly consists of: validated, with units in the names."""

from __future__ import annotations

import tomllib
from importlib import resources
from itertools import pairwise
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from rendulic.dem.laws import LinearFrictional
from rendulic.dem.quasi_static import QuasiStatic
from rendulic.errors import one_of
from rendulic.loading import directions
from rendulic.validation import Positive, Section, validated

__all__ = ["PRESETS", "GrainStudy", "preset"]

PRESETS = ("quick", "paper")


class Packing(Section):
    """The packing (paper, section 4.1)."""

    n_grains: int = Field(ge=20, description="number of spheres")
    radius_min_m: Positive = Field(2e-3, description="smallest radius of the uniform distribution")
    radius_max_m: Positive = Field(18e-3, description="largest radius")
    density_kg_m3: Positive = Field(2600.0, description="density of the grains")
    pressure_pa: Positive = Field(200e3, description="isotropic pressure, and lateral stress of the test")
    seed: int = Field(1, ge=0, description="of radii and places")
    growth_friction: float | None = Field(None, ge=0, description="friction during growth; default: that of the law")
    porosity: float | None = Field(None, gt=0.2, lt=0.6, description="target, if denser than growth gives")


class Contact(Section):
    """The linear frictional law."""

    modulus_pa: Positive = Field(356e6, description="K of k_n = K (R1 + R2)")
    tangential_ratio: Positive = Field(0.42, description="k_t / k_n")
    friction: float = Field(0.7, ge=0, allow_inf_nan=False)
    stiffness_rule: str = "mean_diameter"

    def law(self) -> LinearFrictional:
        """The contact law with these numbers."""
        return LinearFrictional(self.modulus_pa, self.tangential_ratio, self.friction, self.stiffness_rule)


def _increasing(eta: tuple[float, ...]) -> tuple[float, ...]:
    if not eta or not all(0.0 <= value < 3.0 for value in eta):
        raise ValueError("stress ratios must be numbers between 0 and 3")
    if any(later - earlier < 0.01 for earlier, later in pairwise(eta)):
        raise ValueError("stress ratios must increase by at least 0.01, twice the tolerance to which they are reached")
    return eta


StressRatios = Annotated[tuple[float, ...], AfterValidator(_increasing)]


class Loading(Section):
    """How the test is run; see `dem.quasi_static.QuasiStatic`."""

    inertial_number: Positive = 2e-5
    unbalanced_limit: Positive = 5e-3
    damping: float = Field(0.3, ge=0, lt=1)
    mass_scaling: float = Field(1.0, ge=0)
    eta: StressRatios = Field(description="stress ratios q/p of the states to probe, increasing")
    axial_strain: Positive = Field(0.1, description="where the test of Figs. 1 and 2 ends")

    def speed(self) -> QuasiStatic:
        """The rates for the engine."""
        return QuasiStatic(self.inertial_number, self.unbalanced_limit, damping=self.damping,
                           mass_scaling=self.mass_scaling)  # fmt: skip


def _divides_the_circle(step: float) -> float:
    directions.rendulic(step)
    return step


Step = Annotated[Positive, AfterValidator(_divides_the_circle)]


def _increasing_norms(norms: tuple[float, ...]) -> tuple[float, ...]:
    if not norms or list(norms) != sorted(set(norms)):
        raise ValueError("norms must be increasing")
    return norms


Norms = Annotated[tuple[Positive, ...], AfterValidator(_increasing_norms)]


class Probes(Section):
    """The strain probes from each state."""

    step_deg: Step = Field(10.0, description="angle between directions in the Rendulic plane")
    norms: Norms = Field((5e-5,), description="increasing norms of the strain increment")
    diagram_norm: Positive = Field(5e-5, description="the norm drawn in Figs. 3 and 4")
    n_steps: int = Field(5000, ge=1, description="time steps up to the smallest norm")
    damping: float = Field(0.05, ge=0, lt=1)


class Failure(Section):
    """Cones, bursts and anatomy of several packings, loose and dense; probes are as fast as those of `Probes`."""

    n_seeds: int = Field(2, ge=1, description="packings of each density; seeds from the specimen's on")
    loose_eta: StressRatios = Field(
        (0.3, 0.4, 0.48, 0.55, 0.6, 0.65, 0.7), description="stress ratios of the packings of the recipe"
    )
    dense_eta: StressRatios = Field((0.6, 0.8, 1.0), description="stress ratios of the dense packings")
    dense_growth_friction: float = Field(0.0, ge=0, description="friction during growth of the dense packings")
    axial_strain: Positive = Field(0.15, description="where loading is given up")
    norm: Positive = Field(1e-4, description="strain of probes, and of the push that starts a burst")
    norms: Norms = Field((1e-5, 2e-5, 5e-5, 1e-4, 2e-4), description="further sizes to compare cones at")
    step_deg: Step = Field(10.0, description="angle between the directions that cones are first sought in")
    tolerance_deg: Positive = Field(0.5, description="to which the edges of cones are bracketed")
    sphere_directions: int = Field(200, ge=20, description="probes over the whole sphere of principal increments")
    burst_step_deg: Step = Field(20.0, description="angle between the directions of bursts; more lie within cones")


class GrainStudy(Section):
    """A specimen, its loading, the probes of the states on the way, and their failure."""

    specimen: Packing
    contact: Contact = Contact()
    loading: Loading
    probes: Probes = Probes()
    failure: Failure = Failure()

    def model_post_init(self, _context: Any) -> None:
        if self.probes.diagram_norm not in self.probes.norms:
            raise ValueError(f"diagram_norm {self.probes.diagram_norm:g} must be one of the norms {self.probes.norms}")
        if self.specimen.radius_min_m > self.specimen.radius_max_m:
            raise ValueError("radius_min_m must not exceed radius_max_m")
        one_of(self.contact.stiffness_rule, ("mean_diameter", "harmonic"), "stiffness_rule")


def preset(name: str, **changes: Any) -> GrainStudy:
    """The study that ships under this name; `changes` replace values, as `specimen={"seed": 2}`.

    Raises
    ------
    InvalidInput
        If there is no such preset, or a changed value is not admissible.

    Examples
    --------
    >>> preset("paper").specimen.n_grains
    10000
    """
    one_of(name, PRESETS, "preset")
    text = resources.files("rendulic.study").joinpath("presets", f"{name}.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    for section, values in changes.items():
        table.setdefault(section, {}).update(values)
    return validated(GrainStudy, table, f"preset '{name}'")
