"""Columns of the arrays that the kernels fill: each list is the one place that names them.

`places` makes of a list what the kernels index with (`row[RECORD.strain + i]`), `named` what everything else reads
(`named(rows, RECORD_COLUMNS)["strain"]`).
"""

from __future__ import annotations

from rendulic.foundation.columns import named, places, width

__all__ = [
    "EVENT", "EVENT_COLUMNS", "PLANE", "PLANE_COLUMNS", "PLANE_RECORD", "PLANE_RECORD_COLUMNS", "RECORD",
    "RECORD_COLUMNS", "SHARED", "SHARED_ENTRIES", "STATE", "STATE_ENTRIES", "named", "places", "width",
]  # fmt: skip

# to every name, how many numbers it is; stress and strain are Mandel vectors, rates are per unit of arc length
STATE_ENTRIES = {"stress": 6, "strain": 6, "parameter": 1}  # `parameter`: share of the path, 0 to 1
RECORD_COLUMNS = {
    **STATE_ENTRIES,
    "stress_rate": 6, "strain_rate": 6, "parameter_rate": 1,
    "determinant": 1,  # of the controlled problem
    "tan_phi_p": 1, "void_ratio": 1,
}  # fmt: skip
PLANE_RECORD_COLUMNS = {
    "sigma": 1, "tau": 1, "x": 1, "w2": 1, "eps": 1, "gamma": 1, "is_loading": 1, "w2_normalised": 1,
}  # fmt: skip
EVENT_COLUMNS = {"kind": 1, "plane": 1, **STATE_ENTRIES}
# of `Scratch.plane`: what the kernels know of every plane at the present state
PLANE_COLUMNS = {
    "sigma": 1, "tau": 1, "modulus": 1, "x": 1, "hardening": 1, "slope": 1, "beta": 1, "softening": 1, "multiplier": 1,
    "w2": 1, "excess": 1, "kappa": 1,
    "sizes": 1,  # squared, of the rates of stress and strain that make w2
}  # fmt: skip
# of `Scratch.shared`: what all planes share
SHARED_ENTRIES = {
    "stiffness": 1, "tan_peak": 1, "by_pressure": 1, "by_void_ratio": 1, "density": 1, "void_ratio": 1,
    "critical_void_ratio": 1, "determinant": 1,
}  # fmt: skip

STATE = places("StatePlaces", STATE_ENTRIES)
RECORD = places("RecordPlaces", RECORD_COLUMNS)
PLANE_RECORD = places("PlaneRecordPlaces", PLANE_RECORD_COLUMNS)
EVENT = places("EventPlaces", EVENT_COLUMNS)
PLANE = places("PlanePlaces", PLANE_COLUMNS)
SHARED = places("SharedPlaces", SHARED_ENTRIES)
