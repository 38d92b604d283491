"""[[specimen]] of kind "grains": spheres grown in a cube to an isotropic pressure, one packing for each seed."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from rendulic.dem import Assembly, LinearFrictional, QuasiStatic, bring_to_rest, pack
from rendulic.dem.packing import PRESSURE, RADII, check_pressure
from rendulic.dem.state import margins
from rendulic.dem.state.assembly_state import DENSITY
from rendulic.foundation.errors import DidNotConverge, one_of
from rendulic.foundation.validation import Positive, Section, Whole
from rendulic.loading import paths
from rendulic.study.ids import SampleId
from rendulic.study.specimens.section import SpecimenSection
from rendulic.study.task import How, Parts, Task
from rendulic.study.values import Damping, Friction, Porosity, Seeds

__all__ = ["Contact", "GrainsSpecimen", "LoadPacking", "Loading", "MakePacking"]

SOLID = 0.6  # solid fraction, about


class Contact(Section):
    """The linear frictional law of all grains."""

    modulus_pa: Positive = Field(
        LinearFrictional.modulus, description="K of the normal stiffness k_n = K (R1 + R2), Pa"
    )
    tangential_ratio: Positive = Field(LinearFrictional.tangential_ratio, description="k_t / k_n")
    friction: Friction = Field(
        LinearFrictional.friction, description="coefficient of friction between grains; walls have none"
    )
    stiffness_rule: str = Field(LinearFrictional.stiffness_rule, description="mean_diameter or harmonic")

    @model_validator(mode="after")
    def _rule_exists(self) -> Contact:
        one_of(self.stiffness_rule, ("mean_diameter", "harmonic"), "stiffness_rule")
        return self

    def law(self) -> LinearFrictional:
        """The contact law with these numbers."""
        return LinearFrictional(self.modulus_pa, self.tangential_ratio, self.friction, self.stiffness_rule)

    @property
    def strength(self) -> float:
        """The stress ratio that no packing carries: that of the densest lattice, 2(1+mu)/(1-mu) (Thornton 1979)."""
        if self.friction >= 1.0:
            return 3.0
        ratio = 2.0 * (1.0 + self.friction) / (1.0 - self.friction)
        return 3.0 * (ratio - 1.0) / (ratio + 2.0)


class Loading(Section):
    """How packings are made and sheared: quasi-static, see `rd.dem.QuasiStatic`."""

    inertial_number: Positive = Field(QuasiStatic.inertial_number, le=0.1, description="rate of shearing")
    unbalanced_limit: Positive = Field(
        QuasiStatic.unbalanced_limit, lt=1, description="largest unbalanced force while loading"
    )
    damping: Damping = Field(QuasiStatic.damping, description="of Cundall, while preparing and shearing")
    mass_scaling: float = Field(
        QuasiStatic.mass_scaling,
        ge=0,
        le=100,
        strict=True,
        description="inertia of small grains for large steps; 0: none",
    )
    rest_tolerance: Positive = Field(
        QuasiStatic.tolerance, lt=1, description="unbalanced force at which a state counts as at rest"
    )

    def speed(self) -> QuasiStatic:
        """The rates for the engine."""
        return QuasiStatic(
            self.inertial_number, self.unbalanced_limit, damping=self.damping, mass_scaling=self.mass_scaling,
            tolerance=self.rest_tolerance,
        )  # fmt: skip


class Recipe(Section):
    """Spheres grown in a cube to an isotropic pressure."""

    n_grains: Annotated[Whole, Field(ge=20, le=1_000_000)] = Field(description="number of spheres")
    radius_min_m: Positive = Field(RADII[0], description="smallest radius of the uniform distribution, m")
    radius_max_m: Positive = Field(RADII[1], description="largest radius, m")
    density_kg_m3: Positive = Field(DENSITY, description="density of the grains, kg/m3")
    pressure_pa: Positive = Field(PRESSURE, description="isotropic pressure, and lateral stress of the test, Pa")
    growth_friction: Friction | None = Field(
        None, description="friction during growth, less gives denser; the law's if not given"
    )
    porosity: Porosity | None = Field(None, description="target, if denser than growth gives")
    contact: Contact = Contact()
    loading: Loading = Loading()

    @model_validator(mode="after")
    def _radii_in_order(self) -> Recipe:
        if self.radius_min_m > self.radius_max_m:
            raise ValueError(
                f"radius_min_m = {self.radius_min_m:g} must not exceed radius_max_m = {self.radius_max_m:g}"
            )
        if self.radius_max_m > 1000.0 * self.radius_min_m:
            raise ValueError(
                "radius_max_m must not exceed 1000 times radius_min_m: time steps follow the smallest grain"
            )
        return self

    @property
    def mean_radius(self) -> float:
        """In m."""
        return 0.5 * (self.radius_min_m + self.radius_max_m)

    @property
    def edge(self) -> float:
        """About how long the cube is, m."""
        low, high = self.radius_min_m, self.radius_max_m
        mean_cube = (low + high) * (low**2 + high**2) / 4.0
        return (self.n_grains * 4.0 / 3.0 * pi * mean_cube / SOLID) ** (1.0 / 3.0)


class MakePacking(Recipe, Task):
    """One packing at rest under its isotropic pressure."""

    work: ClassVar[str] = "packing"

    seed: Whole

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        sample = pack(
            self.n_grains, (self.radius_min_m, self.radius_max_m), self.pressure_pa, seed=self.seed, law=self.contact.law(),
            density=self.density_kg_m3, growth_friction=self.growth_friction, porosity=self.porosity,
            speed=self.loading.speed(), progress=how.progress,
        )  # fmt: skip
        return {"state": sample.save()}


class LoadPacking(Task):
    """A packing sheared, drained, to a stress ratio and brought to rest there; or on to the end."""

    work: ClassVar[str] = "state"

    eta: float | None
    lateral_stress_pa: float
    axial_strain: float
    loading: Loading

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        sample, speed = Assembly.from_state(needs["before"]["state"]), self.loading.speed()
        left = self.axial_strain - float(sample.strain[0, 0])
        if left <= 0.0:
            raise DidNotConverge(
                f"axial_strain = {self.axial_strain:g} ends before the last state, which is at {sample.strain[0, 0]:.4f}"
            )
        path = paths.drained_triaxial(left, until_eta=self.eta, lateral_stress=self.lateral_stress_pa)
        curve = sample.load(path, speed=speed, progress=how.progress)
        if self.eta is None:
            return {"curve": curve}
        if curve.attrs["stopped_by"] != "eta":
            raise DidNotConverge(
                f"eta = {self.eta:g} was not reached within {self.axial_strain:g} of axial strain (the largest was "
                f"{float(curve.eta.max()):.3f}): ask for smaller stress ratios or a larger strain"
            )
        rest = bring_to_rest(sample, "stress", speed, progress=how.progress)
        curve.attrs |= {"rest": "test paused, then constant stress", "crept": rest.crept.tolist()}
        return {"state": sample.save(), "curve": curve}


class GrainsSpecimen(SpecimenSection, Recipe):
    """Packings of one recipe, one for each seed, sheared drained through their states."""

    has_grains: ClassVar[bool] = True

    kind: Literal["grains"] = Field(description="a packing of spheres")
    seeds: Seeds = Field((1,), description="of radii and places; a packing for each")

    @field_validator("seeds")
    @classmethod
    def _has_a_seed(cls, seeds: tuple[int, ...]) -> tuple[int, ...]:
        if not seeds:
            raise ValueError("there must be at least one seed")
        return seeds

    def samples(self) -> list[SampleId]:
        return [SampleId(self.name, "seed", seed) for seed in self.seeds]

    def about(self, sample: SampleId) -> str:
        return f"{self.n_grains} grains"

    def make(self, sample: SampleId) -> Task:
        recipe = {name: getattr(self, name) for name in Recipe.model_fields}
        return MakePacking(**recipe, seed=int(sample.value))

    def reach(self, eta: float | None) -> Task:
        return LoadPacking(
            eta=eta, lateral_stress_pa=self.pressure_pa, axial_strain=self.axial_strain, loading=self.loading
        )

    def load_options(self) -> dict[str, Any]:
        return {"loading": self.loading.model_dump(mode="json")}

    def check_probe(self, what: str, norm: float) -> None:
        way, margin = norm * self.edge, margins.NEW * self.mean_radius
        if way > margin:
            raise ValueError(
                f"{what}: a probe of norm {norm:g} moves walls {self.edge:.3g} m apart by {way:.2g} m, beyond the margin of "
                f"{margin:.2g} m within which neighbours are known: it is a loading, not a probe; ask for "
                f"{margin / self.edge:.1e} or less"
            )

    def check(self) -> None:
        what = f"specimen '{self.name}'"
        if self.eta and self.eta[-1] > self.contact.strength:
            raise ValueError(
                f"{what}: eta = {self.eta[-1]:g} is beyond the strength of any packing of spheres with friction "
                f"{self.contact.friction:g}: the densest lattice carries {self.contact.strength:.3f}"
            )
        try:
            check_pressure(self.pressure_pa, self.mean_radius, self.contact.law())
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
