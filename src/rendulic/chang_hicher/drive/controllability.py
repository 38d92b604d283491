"""Whether a material point can take a little more of a load at all: loss of controllability.

The counterpart of a burst of kinetic energy in a model without inertia (theory, section 4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rendulic.chang_hicher.drive.equations import control_of
from rendulic.chang_hicher.drive.integration import Integration
from rendulic.chang_hicher.drive.phase import at_rest
from rendulic.chang_hicher.drive.point_curve import point_curve
from rendulic.chang_hicher.state import PointState
from rendulic.foundation.checks import finite_array, positive_number
from rendulic.foundation.errors import InvalidInput

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["burst"]

VERDICTS = {"target": "settles", "loss of controllability": "fails"}
LOAD = 1e-3  # of what the mean stress carries elastically over the norm


def burst(point: PointState, direction, norm: float) -> xr.Dataset:
    """Increase the load along a direction of strain a little, in place; the curve with a verdict.

    The strains move along `direction` u only, and the conjugate stress `s = sigma : u` is increased. That is
    possible if and only if `ds = (u . L . u) e` is positive for e > 0, L the tangent for u: where the second-order
    work of u is negative there is no quasi-static continuation.

    Parameters
    ----------
    direction : (3,) array
        Unit vector of principal strains.
    norm : float
        The load grows by `1e-3 norm` times the present normal stiffness of a plane.

    Returns
    -------
    xarray.Dataset
        As from `MaterialPoint.load`, with `verdict` ("settles" if the load was carried, "fails" if control was
        lost on the way, "undecided" if the model ended there for another reason) and `travelled`, the largest strain along the
        direction over `norm`. The verdict repeats the sign of the tangent by construction: it tests the code, and is no evidence for
        what second-order work predicts.
    """
    u = finite_array("direction of a burst", direction, (3,))
    if abs(np.linalg.norm(u) - 1.0) > 1e-9:
        raise InvalidInput(f"the direction of a burst must be a unit vector, got {u.tolist()}")
    norm = positive_number("norm", norm)
    basis = np.linalg.svd(u[None, :])[2]
    rows = np.zeros((2, 3, 3))
    rows[0, 0], rows[1, 1:] = u, basis[1:]
    start = point.eps[:3].copy()
    stiffness = control_of(point, rows[0], rows[1], np.zeros(3)).strain_scale
    load = LOAD * norm * float(point.sigma[:3].sum()) / 3.0 / stiffness
    control = control_of(point, rows[0], rows[1], np.array([load, 0.0, 0.0]))
    own = Integration(point, control)
    end = own.to_end()
    curve = point_curve(point, "burst", [own.record if len(own.record) else at_rest(point)], end)
    travelled = float(u @ (point.eps[:3] - start)) / norm
    curve.attrs |= {"verdict": VERDICTS.get(end, "undecided"), "travelled": travelled}
    return curve
