"""What a study consists of: packings, their states, what is measured there, element tests, figures; all validated."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from math import pi
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, field_validator, model_validator

from rendulic.dem.drive.growth import check_pressure
from rendulic.dem.drive.quasi_static import QuasiStatic
from rendulic.dem.laws import LinearFrictional
from rendulic.foundation.errors import one_of
from rendulic.foundation.validation import Positive, Section, Whole
from rendulic.loading import directions
from rendulic.study.language.element import ElementTests

__all__ = ["BurstSet", "ConeSet", "Figures", "Packing", "ProbeSet", "Recipe", "Selection", "Study"]

MOST = 10_000  # seeds, sets, tests: a study that needs more is several studies
MARGIN = 0.05  # of the mean radius: how far from each other neighbours are listed, `dem.Assembly`
SOLID = 0.6  # solid fraction, about
FIGURES = ("fig1", "fig2", "fig3", "fig4", "cones", "map", "bursts", "anatomy", "elements")

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=40)]
StressRatio = Annotated[float, Field(strict=True)]
Seed = Annotated[Whole, Field(ge=0, lt=2**63)]


def _different(values: tuple) -> tuple:
    if len(set(values)) < len(values):
        raise ValueError(f"values must differ from each other, got {', '.join(map(str, values))}")
    return values


def _increasing(eta: tuple[float, ...]) -> tuple[float, ...]:
    if not all(0.0 <= value < 3.0 for value in eta):
        raise ValueError(
            "stress ratios q/p must be numbers from 0 to below 3, that of a compression without confinement"
        )
    if any(later - earlier < 0.01 for earlier, later in pairwise(eta)):
        raise ValueError("stress ratios must increase by at least 0.01, twice the tolerance to which they are reached")
    return eta


def _increasing_norms(norms: tuple[float, ...]) -> tuple[float, ...]:
    if not norms or list(norms) != sorted(set(norms)):
        raise ValueError("norms must be increasing")
    return norms


def _divides_the_circle(step: float) -> float:
    directions.rendulic(step)
    return step


Names = Annotated[tuple[Name, ...], Field(max_length=MOST), AfterValidator(_different)]
Seeds = Annotated[tuple[Seed, ...], Field(max_length=MOST), AfterValidator(_different)]
StressRatios = Annotated[tuple[StressRatio, ...], Field(max_length=300), AfterValidator(_increasing)]
Norms = Annotated[tuple[Positive, ...], Field(max_length=100), AfterValidator(_increasing_norms)]
Step = Annotated[Positive, Field(ge=0.1), AfterValidator(_divides_the_circle)]
Friction = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False, strict=True)]
Damping = Annotated[float, Field(ge=0, lt=1, strict=True)]
Porosity = Annotated[float, Field(gt=0.2, lt=0.6, strict=True)]
Grains = Annotated[Whole, Field(ge=20, le=1_000_000)]
Steps = Annotated[Whole, Field(ge=1, le=100_000_000)]


class Contact(Section):
    """The linear frictional law of all grains."""

    modulus_pa: Positive = Field(356e6, description="K of the normal stiffness k_n = K (R1 + R2), Pa")
    tangential_ratio: Positive = Field(0.42, description="k_t / k_n")
    friction: Friction = Field(0.7, description="coefficient of friction between grains and of no wall")
    stiffness_rule: str = Field("mean_diameter", description="mean_diameter or harmonic")

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

    inertial_number: Positive = Field(2e-5, le=0.1, description="rate of shearing")
    unbalanced_limit: Positive = Field(5e-3, lt=1, description="largest unbalanced force while loading")
    damping: Damping = Field(0.3, description="of Cundall, while preparing and shearing")
    mass_scaling: float = Field(
        1.0, ge=0, le=100, strict=True, description="inertia of small grains for large steps; 0: none"
    )

    def speed(self) -> QuasiStatic:
        """The rates for the engine."""
        return QuasiStatic(self.inertial_number, self.unbalanced_limit, damping=self.damping,
                           mass_scaling=self.mass_scaling)  # fmt: skip


class Recipe(Section):
    """Spheres grown in a cube to an isotropic pressure; what all packings of the study share."""

    n_grains: Grains = Field(description="number of spheres")
    radius_min_m: Positive = Field(2e-3, description="smallest radius of the uniform distribution, m")
    radius_max_m: Positive = Field(18e-3, description="largest radius, m")
    density_kg_m3: Positive = Field(2600.0, description="density of the grains, kg/m3")
    pressure_pa: Positive = Field(200e3, description="isotropic pressure, and lateral stress of the test, Pa")
    growth_friction: Friction | None = Field(
        None, description="friction during growth, less gives denser; that of the law"
    )
    porosity: Porosity | None = Field(None, description="target, if denser than growth gives")

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


class Packing(Section):
    """Packings of one recipe, one for each seed, sheared through their states."""

    name: Name = Field(description="names the folders of its results")
    seeds: Seeds = Field((1,), description="of radii and places; a packing for each")
    eta: StressRatios = Field((), description="stress ratios q/p of the states brought to rest, increasing")
    axial_strain: Positive = Field(0.1, le=1, description="where loading ends or is given up")
    to_the_end: bool = Field(False, strict=True, description="whether it goes on to axial_strain after the last state")
    n_grains: Grains | None = Field(None, description="instead of the specimen's, as what follows")
    pressure_pa: Positive | None = Field(None, description="Pa")
    growth_friction: Friction | None = Field(None, description="friction during growth")
    porosity: Porosity | None = Field(None, description="target, if denser than growth gives")

    @field_validator("seeds")
    @classmethod
    def _has_a_seed(cls, seeds: tuple[int, ...]) -> tuple[int, ...]:
        if not seeds:
            raise ValueError("there must be at least one seed")
        return seeds

    def recipe(self, shared: Recipe) -> Recipe:
        """The specimen's recipe with this packing's own values."""
        own = {name: getattr(self, name) for name in Recipe.model_fields if name in Packing.model_fields}
        return shared.model_copy(update={name: value for name, value in own.items() if value is not None})


class Selection(Section):
    """Which states something is measured at; all of them, if nothing is said."""

    name: Name = Field(description="names the files of its results")
    packings: Names = Field((), description="names of packings; all if not given")
    seeds: Seeds = Field((), description="their seeds; all if not given")
    eta: StressRatios = Field((), description="stress ratios of the states; all if not given")

    def picks(self, packing: Packing) -> Iterator[tuple[int, float]]:
        """Seeds and stress ratios of the states of a packing that are meant."""
        if self.packings and packing.name not in self.packings:
            return
        for seed in packing.seeds:
            if not self.seeds or seed in self.seeds:
                yield from ((seed, eta) for eta in packing.eta if not self.eta or eta in self.eta)

    def count(self, packing: Packing) -> int:
        """How many states `picks` gives."""
        if self.packings and packing.name not in self.packings:
            return 0
        seeds = set(packing.seeds) & set(self.seeds) if self.seeds else packing.seeds
        etas = set(packing.eta) & set(self.eta) if self.eta else packing.eta
        return len(seeds) * len(etas)


class ProbeSet(Selection):
    """Probes from every state in many directions, each with a null probe."""

    kind: Literal["strain", "stress"] = Field("strain", description="what is imposed")
    step_deg: Step | None = Field(None, description="angle between directions in the Rendulic plane; 10 if not given")
    sphere_directions: Whole | None = Field(
        None, ge=12, le=100_000, description="instead, so many over the whole sphere"
    )
    norms: Norms = Field((5e-5,), description="increasing sizes of the increment: strain, or Pa for stress")
    n_steps: Steps = Field(5000, description="time steps up to the smallest norm")
    damping: Damping = Field(0.05, description="of Cundall")
    anatomy: bool = Field(False, strict=True, description="whether to tell where in the grains W2 comes from")

    @model_validator(mode="after")
    def _one_set_of_directions(self) -> ProbeSet:
        if self.step_deg is not None and self.sphere_directions is not None:
            raise ValueError("give step_deg for the Rendulic plane or sphere_directions for the sphere, not both")
        return self

    def directions(self) -> directions.Directions | directions.SphereDirections:
        """In the Rendulic plane or on the sphere."""
        if self.sphere_directions is not None:
            return directions.sphere(self.sphere_directions)
        return directions.rendulic(self.step_deg or 10.0)

    def steps_to(self, norm: float) -> int:
        """Time steps up to one of the norms."""
        return max(round(self.n_steps * norm / self.norms[0]), 1)


class ConeSet(Selection):
    """Edges of the unstable sectors of every state, by bisection."""

    answering: Name | None = Field(
        None,
        description="a set of cones: instead of edges, stress probes, to be laid on its strain probes",
    )
    norm: Positive = Field(1e-4, description="size of the strain probes whose cone is drawn")
    norms: Norms | None = Field(None, description="all sizes to compare cones at; `norm` if not given")
    n_steps: Steps = Field(10_000, description="time steps up to the smallest norm")
    damping: Damping = Field(0.05, description="of Cundall")
    step_deg: Step = Field(10.0, le=60, description="angle between the directions that cones are first sought in")
    tolerance_deg: Positive = Field(0.5, le=30, description="to which the edges are bracketed")

    @model_validator(mode="after")
    def _norm_is_among_norms(self) -> ConeSet:
        if self.norms is not None and self.norm not in self.norms:
            raise ValueError(f"norm = {self.norm:g} must be one of the norms {', '.join(f'{n:g}' for n in self.norms)}")
        if self.answering is not None and self.norms is not None:
            raise ValueError("stress probes are as large as the answers to strain probes of `norm`: leave norms out")
        return self

    @property
    def sizes(self) -> tuple[float, ...]:
        """All norms."""
        return self.norms or (self.norm,)


class BurstSet(Section):
    """Bursts around and within the cones of a set: predicted against observed failure."""

    name: Name = Field(description="names the files of its results")
    cones: Name = Field(description="the set of cones; its states, norm and damping are taken")
    n_steps: Steps = Field(10_000, description="time steps of the push")
    step_deg: Step = Field(20.0, description="angle between the directions; more lie within the cones")


class Figures(Section):
    """What is drawn when all that it needs is there, and written under names that people know."""

    draw: tuple[str, ...] = Field((), max_length=len(FIGURES), description="some of " + ", ".join(FIGURES))
    diagram_norm: Positive | None = Field(None, description="size of the probes in Figs. 3 and 4; the smallest")
    tables: bool = Field(
        True, strict=True, description="whether to write states and tables of all units as files of their own"
    )

    @model_validator(mode="after")
    def _figures_exist(self) -> Figures:
        for name in _different(self.draw):
            one_of(name, FIGURES, "figure")
        return self


class Study(ElementTests):
    """Packings of grains, their states, what is measured there; element tests; figures."""

    title: str = Field("", max_length=200, description="for people")
    contact: Contact = Contact()
    loading: Loading = Loading()
    specimen: Recipe | None = Field(None, description="needed if there are packings")
    packing: tuple[Packing, ...] = Field((), max_length=MOST)
    probes: tuple[ProbeSet, ...] = Field((), max_length=MOST)
    cones: tuple[ConeSet, ...] = Field((), max_length=MOST)
    bursts: tuple[BurstSet, ...] = Field((), max_length=MOST)
    figures: Figures = Figures()

    @property
    def shared(self) -> Recipe:
        """The recipe that packings share; there is one where there are packings."""
        assert self.specimen is not None
        return self.specimen

    @model_validator(mode="after")
    def _hangs_together(self) -> Study:
        if not self.packing and not self.test:
            raise ValueError("there is nothing to do: give at least one [[packing]] or one [[test]]")
        if self.packing and self.specimen is None:
            raise ValueError("packings need a section [specimen] with at least n_grains")
        for what in ("packing", "probes", "cones", "bursts"):
            _own_names(what, (each.name for each in getattr(self, what)))
        for packing in self.packing:
            self._check_packing(packing)
        for each in self.probes:
            self._check_selection(each)
        for cones in self.cones:
            self._check_selection(cones)
        for cones in self.cones:
            if cones.answering is not None:
                self._check_answered(cones)
        for bursts in self.bursts:
            told = self._cones_named(bursts.cones, f"bursts '{bursts.name}'")
            if told.answering is not None:
                raise ValueError(
                    f"bursts '{bursts.name}': cones '{told.name}' are of stress probes, bursts need strain"
                )
        self._check_figures()
        return self

    def _check_packing(self, packing: Packing) -> None:
        recipe, what = packing.recipe(self.shared), f"packing '{packing.name}'"
        if packing.eta and packing.eta[-1] > self.contact.strength:
            raise ValueError(
                f"{what}: eta = {packing.eta[-1]:g} is beyond the strength of any packing of spheres with friction "
                f"{self.contact.friction:g}: the densest lattice carries {self.contact.strength:.3f}"
            )
        try:
            check_pressure(recipe.pressure_pa, recipe.mean_radius, self.contact.law())
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None

    def _check_selection(self, chosen: ProbeSet | ConeSet) -> None:
        what = f"{'probes' if isinstance(chosen, ProbeSet) else 'cones'} '{chosen.name}'"
        if not self.packing:
            raise ValueError(f"{what} need a [[packing]] whose states they start from")
        for name in chosen.packings:
            one_of(name, [packing.name for packing in self.packing], f"packing in {what}")
        meant = [packing for packing in self.packing if not chosen.packings or packing.name in chosen.packings]
        for values, there, word in (
            (chosen.seeds, {seed for packing in meant for seed in packing.seeds}, "seed"),
            (chosen.eta, {eta for packing in meant for eta in packing.eta}, "eta"),
        ):
            if unknown := [value for value in values if value not in there]:
                known = ", ".join(f"{value:g}" for value in sorted(there)) or "none"
                raise ValueError(f"{what}: no packing meant has {word} = {unknown[0]:g}; there are {known}")
        if not any(chosen.count(packing) for packing in meant):
            raise ValueError(f"{what}: no state is meant by these packings, seeds and stress ratios together")
        if isinstance(chosen, ConeSet) or chosen.kind == "strain":
            largest = chosen.sizes[-1] if isinstance(chosen, ConeSet) else chosen.norms[-1]
            for packing in meant:
                _check_margin(what, largest, packing.recipe(self.shared))

    def _check_answered(self, cones: ConeSet) -> None:
        answered = self._cones_named(str(cones.answering), f"cones '{cones.name}'")
        if answered.answering is not None:
            raise ValueError(
                f"cones '{cones.name}' answer cones '{answered.name}', which are of stress probes themselves"
            )
        if cones.norm not in answered.sizes:
            raise ValueError(
                f"cones '{cones.name}': norm = {cones.norm:g} is not among those of cones '{answered.name}'"
            )
        self._check_within(cones, answered)

    def _check_within(self, cones: ConeSet, answered: ConeSet) -> None:
        for packing in self.packing:
            if missing := set(cones.picks(packing)) - set(answered.picks(packing)):
                seed, eta = min(missing)
                raise ValueError(
                    f"cones '{cones.name}': cones '{answered.name}' have no state of packing '{packing.name}', seed {seed}, "
                    f"eta = {eta:g}"
                )

    def _cones_named(self, name: str, what: str) -> ConeSet:
        one_of(name, [cones.name for cones in self.cones], f"set of cones in {what}")
        return next(cones for cones in self.cones if cones.name == name)

    def _check_figures(self) -> None:
        for name in self.figures.draw:
            needed, there = {
                "fig1": ("a [[packing]] that goes to_the_end", any(packing.to_the_end for packing in self.packing)),
                "fig2": ("a [[packing]] that goes to_the_end", any(packing.to_the_end for packing in self.packing)),
                "fig3": ("[[probes]] of strain in the Rendulic plane", self.around is not None),
                "fig4": ("[[probes]] of strain in the Rendulic plane", self.around is not None),
                "cones": ("[[cones]]", bool(self.cones)),
                "map": ("[[cones]]", bool(self.cones)),
                "bursts": ("[[bursts]]", bool(self.bursts)),
                "anatomy": ("[[probes]] with anatomy = true", any(each.anatomy for each in self.probes)),
                "elements": ("a [[test]]", bool(self.test)),
            }[name]
            if not there:
                raise ValueError(f"figures: {name} needs {needed}")
        norm = self.figures.diagram_norm
        if norm is not None and (self.around is None or norm not in self.around.norms):
            raise ValueError(f"figures: diagram_norm = {norm:g} must be one of the norms of the probes that are drawn")

    @property
    def around(self) -> ProbeSet | None:
        """The probes that Figs. 3 and 4 show: the first of strain in the Rendulic plane."""
        return next(
            (e for e in self.probes if e.kind == "strain" and e.sphere_directions is None and not e.anatomy), None
        )


def _own_names(what: str, names: Iterable[str]) -> None:
    names = [name.lower() for name in names]
    if len(set(names)) < len(names):
        raise ValueError(f"[[{what}]]: each needs a name of its own, got {', '.join(names)}")


def _check_margin(what: str, norm: float, recipe: Recipe) -> None:
    way, margin = norm * recipe.edge, MARGIN * recipe.mean_radius
    if way > margin:
        raise ValueError(
            f"{what}: a probe of norm {norm:g} moves walls {recipe.edge:.3g} m apart by {way:.2g} m, beyond the margin of "
            f"{margin:.2g} m within which neighbours are known: it is a loading, not a probe; ask for {margin / recipe.edge:.1e} or less"
        )
