"""[[specimen]] of kind "chang_hicher": a sand of the Chang-Hicher model, one sample for each initial void ratio."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from rendulic.chang_hicher import ChangHicher, MaterialPoint, Parameters, material
from rendulic.chang_hicher.drive.integration import LEAST_RECORDS, TOLERANCE
from rendulic.chang_hicher.law.parameters import check_denominator
from rendulic.chang_hicher.law.plane_model import DEFAULT_FORMULATION
from rendulic.foundation.errors import DidNotConverge, InvalidInput
from rendulic.foundation.validation import Positive, Section, Whole
from rendulic.loading import paths
from rendulic.study.ids import SampleId
from rendulic.study.specimens.section import SpecimenSection
from rendulic.study.task import How, Parts, Task
from rendulic.study.values import VoidRatios
from rendulic.tensors.sphere_rules import DEFAULT_DEGREE, SphereRule, bazant_oh_37, lebedev

__all__ = ["LoadSand", "MakeSand", "SandSpecimen", "sphere_rule"]

Formulation = Literal["consistent", "eq32", "printed"]


def sphere_rule(name: str) -> SphereRule:
    """The sphere rule of that name: `bazant_oh_37`, or `lebedev_DEGREE`."""
    if name == "bazant_oh_37":
        return bazant_oh_37()
    kind, _, degree = name.partition("_")
    if kind != "lebedev" or not degree.isdecimal():
        raise InvalidInput(f"a sphere rule is 'bazant_oh_37' or 'lebedev_DEGREE' such as 'lebedev_29', got '{name}'")
    return lebedev(int(degree))


class SandMaterial(Section):
    """A material of the model, and how the model is evaluated."""

    material: Parameters = Field(Parameters(), description="values of its own, instead of the preset's")
    formulation: Formulation = Field(DEFAULT_FORMULATION, description="of the plane law: consistent, eq32 or printed")
    sphere_rule: str = Field(
        f"lebedev_{DEFAULT_DEGREE}", description="lebedev_DEGREE, or bazant_oh_37, that of the paper"
    )

    @field_validator("sphere_rule")
    @classmethod
    def _exists(cls, name: str) -> str:
        sphere_rule(name)
        return name

    @model_validator(mode="after")
    def _planes_do_not_snap(self) -> SandMaterial:
        check_denominator(self.material, self.formulation, self.material.tan_phi_mu)
        return self

    def model(self) -> ChangHicher:
        """The model."""
        return ChangHicher(
            rule=sphere_rule(self.sphere_rule), formulation=self.formulation, **self.material.model_dump()
        )


class MakeSand(SandMaterial, Task):
    """A sand under an isotropic pressure, as it was deposited."""

    work: ClassVar[str] = "sand"

    pressure_pa: float
    void_ratio: float

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        return {"state": self.model().at(self.pressure_pa, self.void_ratio).save()}


class LoadSand(Task):
    """A sand loaded to a stress ratio, drained or undrained; or on to the end."""

    work: ClassVar[str] = "sand state"

    path: Literal["drained", "undrained"]
    eta: float | None
    axial_strain: float
    tolerance: float
    least_records: int

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        point = MaterialPoint.from_state(needs["before"]["state"])
        left = self.axial_strain - float(point.strain[0, 0])
        if left <= 0.0:
            raise DidNotConverge(
                f"axial_strain = {self.axial_strain:g} ends before the last state, which is at {point.strain[0, 0]:.4f}"
            )
        along = paths.drained_triaxial if self.path == "drained" else paths.constant_volume
        curve = point.load(
            along(left, until_eta=self.eta),
            tolerance=self.tolerance,
            least_records=self.least_records,
            progress=how.progress,
        )
        if self.eta is not None and curve.attrs["stopped_by"] != "eta":
            raise DidNotConverge(
                f"eta = {self.eta:g} was not reached within {self.axial_strain:g} of axial strain (the largest was "
                f"{float(curve.eta.max()):.3f}, stopped by {curve.attrs['stopped_by']}): ask for smaller stress ratios"
            )
        return {"state": point.save(), "curve": curve}


class SandSpecimen(SpecimenSection, SandMaterial):
    """Samples of one sand of the Chang-Hicher model, one for each void ratio, loaded through their states."""

    kind: Literal["chang_hicher"] = Field(description="a sand of the Chang-Hicher model")
    preset: str | None = Field(None, description="hostun_loose or fig6_base; values in material replace the preset's")
    pressure_pa: Positive = Field(200e3, description="isotropic pressure of the sand as made, Pa")
    void_ratios: VoidRatios = Field(min_length=1, description="initial void ratios; a sample for each")
    path: Literal["drained", "undrained"] = Field("drained", description="the test that leads to its states")
    axial_strain: Positive = Field(0.5, le=1, description="largest axial strain; loading ends there")
    tolerance: Positive = Field(TOLERANCE, le=1e-2, description="error per step, relative to the stress")
    least_records: Whole = Field(LEAST_RECORDS, ge=1, le=1_000_000, description="records of a curve, at least")

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        if own := sorted(set(table) & set(Parameters.model_fields)):
            raise ValueError(f"values of the material belong into it: material = {{ {own[0]} = ... }}")
        given = table.get("material", {})
        if isinstance(table.get("preset"), str) and isinstance(given, dict):
            return {**table, "material": {**material(table["preset"]).model_dump(), **given}}
        return table

    def samples(self) -> list[SampleId]:
        return [SampleId(self.name, "e", void_ratio) for void_ratio in self.void_ratios]

    def about(self, sample: SampleId) -> str:
        return "Chang-Hicher model"

    def make(self, sample: SampleId) -> Task:
        own = {name: getattr(self, name) for name in SandMaterial.model_fields}
        return MakeSand(**own, pressure_pa=self.pressure_pa, void_ratio=sample.value)

    def reach(self, eta: float | None) -> Task:
        return LoadSand(
            path=self.path,
            eta=eta,
            axial_strain=self.axial_strain,
            tolerance=self.tolerance,
            least_records=self.least_records,
        )

    def load_options(self) -> dict[str, Any]:
        return {"tolerance": self.tolerance, "least_records": self.least_records}

    def check(self) -> None:
        model = self.model()
        for void_ratio in self.void_ratios:
            try:
                model.at(self.pressure_pa, void_ratio)
            except InvalidInput as error:
                raise InvalidInput(f"specimen '{self.name}', e = {void_ratio:g}: {error}") from None
