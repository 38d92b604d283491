"""Element tests of the Chang-Hicher model, described in a TOML file."""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import resources
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from rendulic.chang_hicher import ChangHicher, MaterialPoint, Parameters, material
from rendulic.chang_hicher.law.parameters import check_denominator
from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.progress import Progress, silent
from rendulic.foundation.validation import Positive, Section, read_toml, validated
from rendulic.loading import paths
from rendulic.tensors.sphere_rules import SphereRule, bazant_oh_37, lebedev

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "ElementStudy", "ElementTest", "ElementTests", "Leg", "check_states", "example", "follow_test", "read_element_study",
]  # fmt: skip

PATHS: dict[str, Callable[..., paths.Path]] = {
    "drained": paths.drained_triaxial,
    "undrained": paths.constant_volume,
    "constant_p": paths.constant_p,
    "oedometric": paths.oedometric,
    "isotropic": paths.isotropic,
    "proportional": paths.proportional,
}
MOST = 100_000  # tests of one study
# what each kind of leg understands, and the argument of its path
ARGUMENTS: dict[str, dict[str, str]] = {
    "drained": {
        "axial_strain": "until_strain", "until_eta": "until_eta", "until_peak": "until_peak",
        "extension": "extension", "lateral_stress_pa": "lateral_stress",
    },
    "undrained": {
        "axial_strain": "until_strain", "until_eta": "until_eta", "until_peak": "until_peak", "extension": "extension",
    },
    "constant_p": {"axial_strain": "until_strain", "until_eta": "until_eta", "until_peak": "until_peak"},
    "oedometric": {"axial_strain": "until_strain", "extension": "extension"},
    "isotropic": {"pressure_pa": "pressure"},
    "proportional": {
        "ratio": "ratio", "axial_strain": "until_strain", "until_eta": "until_eta", "until_peak": "until_peak",
    },
}  # fmt: skip


class Leg(Section):
    """One path, followed from where the last one ended."""

    path: Literal["drained", "undrained", "constant_p", "oedometric", "isotropic", "proportional"]
    axial_strain: Positive | None = Field(None, description="axial strain travelled at most; 0.2 if not given")
    until_eta: float | None = Field(
        None, strict=True, allow_inf_nan=False, description="stress ratio q/p at which it ends"
    )
    until_peak: bool = Field(False, description="end when q has fallen by 5 % from its peak")
    extension: bool = Field(False, description="axial extension instead of compression; also unloading")
    lateral_stress_pa: Positive | None = Field(None, description="drained: brought there first")
    pressure_pa: Positive | None = Field(None, description="isotropic: the pressure to reach")
    ratio: float | None = Field(
        None, strict=True, allow_inf_nan=False, description="proportional: R of d_eps_1 + 2 R d_eps_3 = 0"
    )

    @model_validator(mode="after")
    def _only_what_the_path_knows(self) -> Leg:
        known = ARGUMENTS[self.path]
        # a test's own pressure is that of its initial state
        given = {name for name in Leg.model_fields if name in self.model_fields_set} - {"path", *self._state()}
        for name in sorted(given - set(known)):
            raise ValueError(f"a path '{self.path}' has no '{name}': it takes {', '.join(known)}")
        for name in ("pressure_pa", "ratio"):
            if name in known and name not in self._state() and getattr(self, name) is None:
                raise ValueError(f"a path '{self.path}' needs '{name}'")
        return self

    def _state(self) -> set[str]:
        return set()

    def loading_path(self) -> paths.Path:
        """The path itself."""
        values = {name: getattr(self, name) for name in ARGUMENTS[self.path] if name in self.model_fields_set}
        if "axial_strain" in ARGUMENTS[self.path]:
            values.setdefault("axial_strain", 0.2)
        return PATHS[self.path](**{ARGUMENTS[self.path][name]: value for name, value in values.items()})


class ElementTest(Leg):
    """A virgin isotropic state, its first leg, and those that follow."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=60, description="names the files")
    path: Literal["drained", "undrained", "constant_p", "oedometric", "proportional"]
    pressure_pa: Positive = Field(description="of the virgin state")
    void_ratio: Positive = Field(le=3, description="of the virgin state")
    then: tuple[Leg, ...] = Field((), description="further legs, as [{ path = ..., ... }]")

    def _state(self) -> set[str]:
        return {"pressure_pa"}


class Model(Section):
    """How the model is evaluated."""

    formulation: Literal["consistent", "eq32", "printed"] = "consistent"
    sphere_rule: str = Field("bazant_oh_37", description="bazant_oh_37, or lebedev_DEGREE")
    tolerance: Positive = Field(1e-8, le=1e-2, description="error per step, relative to the stress")

    @field_validator("sphere_rule")
    @classmethod
    def _exists(cls, name: str) -> str:
        _rule(name)
        return name


class ElementTests(Section):
    """A material and any number of tests on it."""

    material: Parameters = Parameters()
    model: Model = Model()
    test: tuple[ElementTest, ...] = Field((), max_length=MOST, description="[[test]] tables")

    @field_validator("material", mode="before")
    @classmethod
    def _from_preset(cls, table: Any) -> Any:
        if isinstance(table, dict) and "preset" in table:
            values = dict(table)
            return {**material(str(values.pop("preset"))), **values}
        return table

    @model_validator(mode="after")
    def _planes_do_not_snap(self) -> ElementTests:
        check_denominator(self.material, self.model.formulation, self.material.tan_phi_mu)
        return self

    @field_validator("test")
    @classmethod
    def _different_names(cls, tests: tuple[ElementTest, ...]) -> tuple[ElementTest, ...]:
        names = [test.name.lower() for test in tests]
        if len(set(names)) < len(names):
            raise ValueError(f"every test needs a name of its own, got {', '.join(names)}")
        return tests


class ElementStudy(ElementTests):
    """A material and the tests on it."""

    test: tuple[ElementTest, ...] = Field(min_length=1, max_length=MOST, description="[[test]] tables")


def _rule(name: str) -> SphereRule:
    if name == "bazant_oh_37":
        return bazant_oh_37()
    kind, _, degree = name.partition("_")
    if kind != "lebedev" or not degree.isdecimal():
        raise InvalidInput(f"a sphere rule is 'bazant_oh_37' or 'lebedev_DEGREE' such as 'lebedev_29', got '{name}'")
    return lebedev(int(degree))


def example() -> str:
    """The text of a commented study to begin with."""
    return resources.files("rendulic.study").joinpath("presets", "element_tests.toml").read_text(encoding="utf-8")


def read_element_study(path: str | os.PathLike) -> ElementStudy:
    """Read and check a study.

    Raises
    ------
    InvalidInput
        If there is no such file, it is not TOML, or any entry is not admissible: the entry is named.
    """
    table = read_toml(path, f"no element study at {path}: check the path, or write one with --init")
    return validated(ElementStudy, table, str(path))


def check_states(study: ElementTests) -> None:
    """Raise `InvalidInput`, which names the test, if the material admits no such virgin state."""
    if not study.test:
        return
    model = _model(study)
    for test in {(test.pressure_pa, test.void_ratio): test for test in study.test}.values():
        _point(model, test)


def _model(study: ElementTests) -> ChangHicher:
    how = study.model
    return ChangHicher(rule=_rule(how.sphere_rule), formulation=how.formulation, **study.material.model_dump())


def _point(model: ChangHicher, test: ElementTest) -> MaterialPoint:
    try:
        return model.at(test.pressure_pa, test.void_ratio)
    except InvalidInput as error:
        raise InvalidInput(f"test '{test.name}': {error}") from None


def follow_test(study: ElementTests, test: ElementTest, progress: Progress = silent) -> xr.Dataset:
    """All legs of a test as one curve, with the coordinate `leg`."""
    point, tolerance = _point(_model(study), test), study.model.tolerance
    legs: list[xr.Dataset] = []
    for k, leg in enumerate((test, *test.then)):
        try:
            curve = point.load(leg.loading_path(), tolerance=tolerance, progress=progress)
        except InvalidInput as error:
            raise InvalidInput(f"test '{test.name}', leg {k + 1}: {error}") from None
        curve = curve.assign_coords(
            leg=("record", np.full(curve.sizes["record"], k + 1)),
            event_leg=("event", np.full(curve.sizes["event"], k + 1)),
        )
        legs.append(curve)
        if curve.attrs["stopped_by"] not in ("strain", "eta", "peak", "target"):
            break
    own = {"path": ", then ".join(leg.attrs["path"] for leg in legs), "test": test.name}
    return _joined(legs).assign_attrs(legs[-1].attrs | own)


def _joined(legs: list[xr.Dataset]) -> xr.Dataset:
    """Records and events of all legs one after the other; what does not grow is that of the first."""
    import xarray as xr

    variables = {}
    for name, variable in legs[0].variables.items():
        grows = [dim for dim in variable.dims if dim in ("record", "event")]
        values = variable.values
        if grows:
            values = np.concatenate([leg[name].values for leg in legs], axis=variable.dims.index(grows[0]))
        variables[name] = (variable.dims, values, variable.attrs)
    return xr.Dataset(variables).set_coords(list(legs[0].coords))
