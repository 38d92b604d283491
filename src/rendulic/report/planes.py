"""Contact planes on the sphere as a test goes on, with plotly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rendulic.report.draw import interactive
from rendulic.report.figure import Figure, Trace
from rendulic.report.spheres import ball, dots, scene
from rendulic.views.planes import PlanesView

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["planes"]

FRAMES, MOST_TESTS = 13, 6  # on the page
QUANTITIES = (("w2n_plane", "W2n of the plane", True), ("x_plane", "obliquity over peak friction", False))


@interactive(PlanesView)
def planes(name: str, views: Mapping[str, PlanesView]) -> Figure:
    """A family for each test and quantity, a slider over the axial strain."""
    shown = dict(list(views.items())[:MOST_TESTS])
    families = {
        f"{label}: {title}": {
            f"ε₁ = {100 * float(view.curve.eps_1[at]):.3g} %": [
                _on_sphere(view.curve.isel(record=at), quantity, title, signed)
            ]
            for at in np.unique(np.linspace(0, view.curve.sizes["record"] - 1, FRAMES).astype(int)).tolist()
        }
        for label, view in shown.items()
        for quantity, title, signed in QUANTITIES
    }
    left = len(views) - len(shown)
    caption = next(iter(views.values())).caption + (f" {left} more tests are in the files." if left else "")
    return Figure(name, caption, families, scene(), "Test and quantity", "Axial strain", [ball()], start=-1)


def _on_sphere(now: xr.Dataset, quantity: str, title: str, signed: bool) -> Trace:
    normals, values = now.plane_normal.transpose("plane", "component").values, now[quantity].values
    words = [
        f"plane {k}, {float(now.inclination[k]):.1f}° to axis 1<br>σ {1e-3 * float(now.sigma_plane[k]):.4g} kPa, τ "
        f"{1e-3 * float(now.tau_plane[k]):.4g} kPa<br>obliquity {float(now.x_plane[k]):.3f}, W2n "
        f"{float(now.w2n_plane[k]):+.3f}"
        f"<br>{'plastic' if bool(now.is_loading[k]) else 'elastic'}"
        for k in range(len(values))
    ]
    return dots(np.concatenate((normals, -normals)), np.concatenate((values, values)), words * 2, title, signed)
