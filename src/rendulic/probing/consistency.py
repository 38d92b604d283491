"""Stress probes beside strain probes: equal direction and size of strain must have the same second-order work."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rendulic.foundation.errors import InvalidInput
from rendulic.tensors.rendulic_plane import direction_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["stress_on_strain"]


def stress_on_strain(strain_probes: xr.Dataset, stress_probes: xr.Dataset) -> xr.Dataset:
    """W2n of stress probes beside that of strain probes of one state, at equal direction and size of strain.

    A stress probe of one size is answered by strains of very different sizes: in the soft directions they are large.
    W2n depends on the size near failure, so strain probes of several sizes are interpolated, linearly in the
    direction and in the logarithm of the size.

    Parameters
    ----------
    strain_probes : xarray.Dataset
        From `rd.probe` with several norms.
    stress_probes : xarray.Dataset
        From `rd.probe` with `kind="stress"` and one norm, of the same state.

    Returns
    -------
    xarray.Dataset
        Dimension `alpha`, the direction of stress: `strain_alpha` in degrees and `strain_norm`, the strain that answered;
        `w2_normalised` of the stress probe; `expected`, that of the strain probes, NaN where the strain is larger or
        smaller than all of them. The attribute `rms` is the root mean square of their difference, `n_compared` how
        many there are.

    Raises
    ------
    InvalidInput
        If the probes are not of these kinds.
    """
    import xarray as xr

    if "norm" not in strain_probes.dims or strain_probes.sizes["norm"] < 2:
        raise InvalidInput("strain probes of two norms or more are needed to compare at equal size")
    if "norm" in stress_probes.dims:
        raise InvalidInput("stress probes of one norm are needed: choose it with .sel(norm=...)")
    d_eps = stress_probes.d_eps.transpose("alpha", ...).values
    angle, size = direction_of(d_eps), np.linalg.norm(d_eps, axis=1)
    probed = strain_probes.sortby("alpha")
    alpha, norms = probed.alpha.values, probed.norm.values
    around = np.concatenate((alpha[-1:] - 360.0, alpha, alpha[:1] + 360.0))
    w2n = probed.w2_normalised.transpose("norm", "alpha").values
    at_angle = [np.interp(angle, around, np.concatenate((row[-1:], row, row[:1]))) for row in w2n]
    rows = np.array(at_angle).T
    expected = [
        np.interp(np.log(one), np.log(norms), row, left=np.nan, right=np.nan)
        for one, row in zip(size, rows, strict=True)
    ]
    found = stress_probes.w2_normalised.values
    difference = found - np.array(expected)
    compared = np.isfinite(difference)
    return xr.Dataset(
        {
            "strain_alpha": ("alpha", angle, {"units": "degree", "long_name": "direction of the strain that answered"}),
            "strain_norm": ("alpha", size, {"units": "1", "long_name": "norm of the strain that answered"}),
            "w2_normalised": ("alpha", found, {"units": "1", "long_name": "W2n of the stress probe"}),
            "expected": ("alpha", np.array(expected), {"units": "1", "long_name": "W2n of strain probes"}),
        },
        coords={"alpha": stress_probes.alpha},
        attrs={
            "rms": float(np.sqrt(np.mean(difference[compared] ** 2))) if compared.any() else float("nan"),
            "n_compared": int(compared.sum()),
        },
    )
