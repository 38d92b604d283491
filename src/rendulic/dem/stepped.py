"""An assembly's state with the single operations that change it as methods."""

from __future__ import annotations

import numpy as np

from rendulic.dem.drive.masses import scale_masses, scale_radii
from rendulic.dem.drive.numbering import sort_grains
from rendulic.dem.drive.stepping import advance, tighten_list
from rendulic.dem.drive.stopping import stop_rattlers, stop_spins
from rendulic.dem.drive.tangential_forces import set_tangential_forces
from rendulic.dem.drive.time_step import renew_time_step, set_time_step
from rendulic.dem.kernels.arrays import Drive
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.whole_change import whole_change

__all__ = ["SteppedState"]


class SteppedState(AssemblyState):
    """An `AssemblyState` that is changed in place; part of the face, as `Assembly` is."""

    @whole_change
    def advance(self, n_steps: int, drive: Drive, damping: float | None = None) -> None:
        """Make `n_steps` steps of the present time step under `drive`; without `damping` with the assembly's own.

        Raises
        ------
        UnstableTimeStep
            If the motion diverges.
        """
        advance(self, n_steps, drive, damping)

    @whole_change
    def set_time_step(self, time_step: float | None = None) -> None:
        """Fix the time step in s; without an argument take the stated fraction of the critical one.

        Raises
        ------
        UnstableTimeStep
            If it is not positive, or above 0.58 of the critical one.
        """
        set_time_step(self, time_step)

    @whole_change
    def renew_time_step(self) -> None:
        """Take the time step that the present contacts allow, or check the one that was fixed."""
        renew_time_step(self)

    @whole_change
    def reset_strain(self) -> None:
        """Make the present walls the origin of strain."""
        self.strain_origin = self.lengths

    @whole_change
    def tighten_list(self) -> None:
        """List neighbours within a narrow margin, for small motions; it widens again if need be."""
        tighten_list(self)

    @whole_change
    def scale_masses(self, inertial_radius: float) -> None:
        """Give grains smaller than `inertial_radius` [m] more mass; 0 restores the true masses.

        Velocities stay, and the change of kinetic energy is counted as damping. The time step stays as it is: call
        `set_time_step`.
        """
        scale_masses(self, inertial_radius)

    @whole_change
    def scale_radii(self, factor: float) -> None:
        """Multiply all radii by `factor`, masses following; forces follow at the next step."""
        scale_radii(self, factor)

    @whole_change
    def set_tangential_forces(self, first: np.ndarray, second: np.ndarray, force: np.ndarray, age: float = 0.0) -> None:
        """Give contacts `first < second` the tangential forces (n, 3) on `second` in N of another engine.

        `age` in s is how much older than the positions the forces are: they are advanced by the
        present velocities. Pairs that do not touch are left open; forces beyond the friction limit
        are scaled to it.
        """
        set_tangential_forces(self, first, second, force, age)

    @whole_change
    def stop_rattlers(self) -> None:
        """Stop the grains with fewer than two contacts; the kinetic energy taken is counted as damping."""
        stop_rattlers(self)

    @whole_change
    def stop_spins(self) -> None:
        """Stop all rotation; the kinetic energy taken is counted as damping."""
        stop_spins(self)

    @whole_change
    def sort_grains(self) -> None:
        """Renumber the grains along a space-filling curve; the mechanics does not change."""
        sort_grains(self)
