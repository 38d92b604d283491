"""[[path]]: tests of a specimen along any path, from the state as it was made or from its states."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from rendulic.foundation.errors import InvalidInput
from rendulic.foundation.validation import Positive, Section
from rendulic.loading import paths
from rendulic.specimen.registry import specimen_of
from rendulic.study.ids import StateId
from rendulic.study.specimens.union import follow
from rendulic.study.task import How, Parts, Task
from rendulic.study.tasks.measurement import AnyPlan, Selected

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Leg", "PathOfState", "PathSet"]

PATHS: dict[str, Callable[..., paths.Path]] = {
    "drained": paths.drained_triaxial,
    "undrained": paths.constant_volume,
    "constant_p": paths.constant_p,
    "oedometric": paths.oedometric,
    "isotropic": paths.isotropic,
    "proportional": paths.proportional,
}
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
GOES_ON = ("strain", "eta", "peak", "target")  # how a leg must have ended for the next one to follow


class Leg(Section):
    """One path, followed from where the last one ended."""

    path: Literal["drained", "undrained", "constant_p", "oedometric", "isotropic", "proportional"] = Field(
        description="what is controlled"
    )
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
        given = {name for name in Leg.model_fields if name in self.model_fields_set} - {"path"}
        for name in sorted(name for name in given - set(known) if getattr(self, name) is not None):
            raise ValueError(f"a path '{self.path}' has no '{name}': it takes {', '.join(known)}")
        for name in ("pressure_pa", "ratio"):
            if name in known and getattr(self, name) is None:
                raise ValueError(f"a path '{self.path}' needs '{name}'")
        return self

    def loading_path(self) -> paths.Path:
        """The path itself."""
        known = ARGUMENTS[self.path]
        values = {name: getattr(self, name) for name in known if getattr(self, name) not in (None, False)}
        if "axial_strain" in known:
            values.setdefault("axial_strain", 0.2)
        return PATHS[self.path](**{known[name]: value for name, value in values.items()})


class PathSet(Selected, Leg):
    """A test along one path or several, one after the other; from the sample as made, or from its states if eta is given."""

    table: ClassVar[str] = "path"
    work: ClassVar[str] = "path"
    order: ClassVar[int] = 50

    then: tuple[Leg, ...] = Field(
        (),
        description="further legs, as [{ path = ..., ... }]; a sand's cycles are elastic after the first and conserve no energy",
    )

    def of_sample(self, states: Iterator[StateId]) -> Iterator[StateId]:
        first, *others = states
        return iter([state for state in others if state.eta in self.eta] if self.eta else [first])

    def add(self, plan: AnyPlan, state: StateId | None) -> None:
        assert state is not None
        task = PathOfState(legs=(self, *self.then), options=plan.load_options(state))
        plan.put(self, state, task.unit(f"{self.what}: {state}", state=plan.state(state)))

    def write(self, result: Any, path: Path) -> list[Path]:
        """The curve as NetCDF, its records, events and planes as CSV."""
        from rendulic.io.tables import write_csv

        files = super().write(result, path)
        return files + [
            write_csv(table, path.with_name(f"{path.name}{suffix}.csv")) for suffix, table in _tables(result).items()
        ]


class PathOfState(Task):
    """All legs of a test as one curve, with the coordinate `leg`."""

    work: ClassVar[str] = "test"

    legs: tuple[Leg, ...]
    options: dict[str, Any]

    def run(self, needs: Mapping[str, Parts], how: How) -> Parts:
        specimen: Any = specimen_of(needs["state"]["state"])
        legs: list[xr.Dataset] = []
        for k, leg in enumerate(self.legs):
            try:
                curve = follow(specimen, leg.loading_path(), self.options, how.progress)
            except InvalidInput as error:
                raise InvalidInput(f"leg {k + 1}: {error}") from None
            own = {"leg": ("record", np.full(curve.sizes["record"], k + 1))}
            if "event" in curve.sizes:
                own["event_leg"] = ("event", np.full(curve.sizes["event"], k + 1))
            legs.append(curve.assign_coords(own))
            if curve.attrs["stopped_by"] not in GOES_ON:
                break
        names = ", then ".join(leg.attrs["path"] for leg in legs)
        return {"curve": _joined(legs).assign_attrs(legs[-1].attrs | {"path": names}), "state": specimen.save()}


def _joined(legs: list[xr.Dataset]) -> xr.Dataset:
    """Records and events of all legs one after the other; what does not grow is taken from the first."""
    import xarray as xr

    variables = {}
    for name, variable in legs[0].variables.items():
        grows = [dim for dim in variable.dims if dim in ("record", "event")]
        values = variable.values
        if grows:
            values = np.concatenate([leg[name].values for leg in legs], axis=variable.dims.index(grows[0]))
        variables[name] = (variable.dims, values, variable.attrs)
    return xr.Dataset(variables).set_coords(list(legs[0].coords))


def _tables(curve: xr.Dataset) -> dict[str, xr.Dataset]:
    """The curve in tables of one index each."""
    plain = curve.reset_coords()

    def with_dims(*dims: str) -> list[str]:
        return [str(name) for name in plain.data_vars if plain[name].dims == dims]

    tables = {"": plain[with_dims("record")]}
    if "event" in plain.dims:
        tables["_events"] = plain[with_dims("event")]
    if "plane" in plain.dims:
        tables["_planes"] = plain[[*with_dims("record", "plane"), "inclination", "plane_weight", "eps_1", "leg"]]
    return tables
