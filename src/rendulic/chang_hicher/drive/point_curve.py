"""The labelled curve of a path followed by a material point: assembly, planes, events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rendulic.chang_hicher.drive.phase import PhaseRecord, joined
from rendulic.chang_hicher.kernels.events import EVENTS
from rendulic.chang_hicher.state import PointState
from rendulic.specimen.curve import labelled_curve, stress_columns
from rendulic.tensors.mandel import to_tensor

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["point_curve"]

ALONG = {
    "w2": ("second-order work per squared strain rate", "Pa"),
    "w2_normalised": ("normalised second-order work along the path", "1"),
    "tan_phi_p": ("peak friction of the planes", "1"),
    "hill": ("smallest eigenvalue of the symmetric tangent stiffness", "Pa"),
    "det_tangent": ("determinant of the tangent stiffness over the first", "1"),
    "det_control": ("determinant of the controlled problem over the first", "1"),
}
LOCAL = {
    "sigma_plane": ("normal stress on the plane", "Pa"),
    "tau_plane": ("shear stress on the plane", "Pa"),
    "eps_plane": ("normal strain of the plane", "1"),
    "gamma_plane": ("shear strain of the plane", "1"),
    "x_plane": ("obliquity over peak friction", "1"),
    "w2_plane": ("second-order work of the plane per squared strain rate", "Pa"),
    "w2n_plane": ("normalised second-order work of the plane; 0 where nothing moves", "1"),
    "is_loading": ("plane in plastic loading", "1"),
}


def point_curve(point: PointState, path_name: str, phases: Sequence[PhaseRecord], stopped_by: str) -> xr.Dataset:
    """Curve, local quantities and events as one dataset; `phases` are controls followed one after the other.

    `w2` and `w2_plane` are per squared rate of the axial strain (of the largest principal strain where
    the axial one rests), hence in Pa: times the square of a strain increment they are the second-order
    work of that increment. `3 sum(plane_weight w2_plane)` is `w2` to rounding (Eq. 45).

    Dimensions: `record`; `plane`, with coordinates `plane_normal`, `plane_weight` and `inclination` to
    axis 1 in degrees; `event`, in the order in which they happened, with the state at each.
    """
    import xarray as xr

    whole = joined([phase.of_all_planes() for phase in phases])
    record, plane, event = whole.record, whole.plane_record, whole.event
    columns = stress_columns(to_tensor(record["stress"]), to_tensor(record["strain"]))
    columns |= {"void_ratio": record["void_ratio"]}
    curve = labelled_curve(path_name, columns, stopped_by=stopped_by, formulation=point.model.formulation)
    rate = _strain_rate(record["strain_rate"])
    along = _along(whole, rate, [len(phase) for phase in phases])
    local = {
        "sigma_plane": plane["sigma"],
        "tau_plane": plane["tau"],
        "eps_plane": plane["eps"],
        "gamma_plane": plane["gamma"],
        "x_plane": plane["x"],
        "w2_plane": plane["w2"] / rate[:, None] ** 2,
        "w2n_plane": plane["w2_normalised"],
        "is_loading": plane["is_loading"] > 0.5,
    }
    at = stress_columns(to_tensor(event["stress"]), to_tensor(event["strain"]))
    rule = point.model.rule
    # one dataset at once: every merge takes as long as a third of the test
    return xr.Dataset(
        dict(curve.variables)
        | {name: ("record", along[name], _labels(*ALONG[name])) for name in ALONG}
        | {name: (("record", "plane"), local[name], _labels(*LOCAL[name])) for name in LOCAL}
        | {f"event_{name}": ("event", at[name], curve[name].attrs) for name in ("eps_1", "eps_v", "p", "q", "eta")}
        | {
            "event_kind": ("event", np.array([EVENTS[int(kind)] for kind in event["kind"]], dtype=str)),
            "event_plane": ("event", event["plane"].astype(int), {"long_name": "plane, -1 for the assembly"}),
        },
        {
            "plane": ("plane", np.arange(len(point.memory))),
            "plane_normal": (("plane", "component"), rule.normals),
            "plane_weight": ("plane", point.model.planes.weight3 / 3.0, {"long_name": "weight, of sum 1"}),
            "inclination": ("plane", rule.inclination, _labels("angle of the plane's normal to axis 1", "degree")),
            "component": [1, 2, 3],
        },
        curve.attrs,
    )


def _labels(long_name: str, units: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}


def _strain_rate(strain_rate: np.ndarray) -> np.ndarray:
    """Rate of axial strain per arc length, or of the largest principal strain where the axial one rests."""
    rates = np.abs(strain_rate[:, :3])
    largest = rates.max(axis=1, initial=0.0)
    return np.where(rates[:, 0] > 1e-6 * largest, rates[:, 0], largest)


def _along(whole: PhaseRecord, rate: np.ndarray, lengths: list[int]) -> dict[str, np.ndarray]:
    """The quantities of `ALONG`."""
    record, compliances = whole.record, whole.compliance
    d_sigma, d_eps = record["stress_rate"], record["strain_rate"]
    w2 = (d_sigma * d_eps).sum(axis=1)
    known = np.isfinite(compliances).all(axis=(1, 2))
    known[known] = np.abs(np.linalg.det(compliances[known])) > 0.0
    stiffness = np.full_like(compliances, np.nan)
    stiffness[known] = np.linalg.inv(compliances[known])
    symmetric = 0.5 * (stiffness + stiffness.swapaxes(1, 2))
    hill = np.full(len(known), np.nan)
    hill[known] = np.linalg.eigvalsh(symmetric[known])[:, 0]
    determinant = np.full(len(known), np.nan)
    determinant[known] = np.linalg.det(stiffness[known])
    # the determinants of two phases are of two controlled problems
    determinants = np.split(record["determinant"], np.cumsum(lengths)[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            "w2": w2 / rate**2,
            "w2_normalised": w2 / (np.linalg.norm(d_sigma, axis=1) * np.linalg.norm(d_eps, axis=1)),
            "tan_phi_p": record["tan_phi_p"],
            "hill": hill,
            "det_tangent": determinant / determinant[:1],
            "det_control": np.concatenate([own / own[:1] for own in determinants]),
        }
