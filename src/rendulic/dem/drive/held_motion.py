"""The verdict on a specimen that moves under a held load: numbers that belong to the material, none to how it was watched."""

from __future__ import annotations

import numpy as np

from rendulic.dem.measure.trend import Trend, trend

__all__ = ["HeldMotion"]

CALM_LOOKS = 3  # for which rest must last
AVALANCHE = 0.1  # of the elastic strain: a longer way was an avalanche, which ended or did not
FAR = 2.5  # limits of strain: who has run so far has failed, however slowly it moves by then


class HeldMotion:
    """What was seen of a motion so far, and what follows.

    The verdict falls at an event, at rest or beyond a limit of strain, and not after a number of steps. So a longer watch
    can decide what a shorter one left open, and cannot change what that one said.

    Parameters
    ----------
    norm : float
        Size of the push, a strain.
    elastic_strain : float
        Strain `2 E / (p V)` that belongs to the stored energy E at the mean stress p.
    strain_limit : float
        Strain along the direction of the push beyond which a motion that does not decay is a failure.
    """

    def __init__(self, norm: float, elastic_strain: float, strain_limit: float) -> None:
        self.norm, self.elastic_strain, self.strain_limit = norm, elastic_strain, strain_limit
        self.time: list[float] = []
        self.strain: list[float] = []
        self.kinetic: list[float] = []
        self.calm = 0
        self.furthest = 0.0

    def see(self, time: float, strain: float, kinetic: float, *, at_rest: bool = False) -> None:
        """One look: time in s, strain along the direction since the beginning, kinetic energy in any unit."""
        self.time.append(time)
        self.strain.append(strain)
        self.kinetic.append(kinetic)
        self.calm = self.calm + 1 if at_rest else 0
        self.furthest = max(self.furthest, strain, key=abs)

    @property
    def beyond(self) -> float:
        """Strain by which it left the range of the push, from 0 to `norm`."""
        return max(self.furthest - self.norm, -self.furthest, 0.0)

    @property
    def verdict(self) -> str:
        """ "settles", "arrested", "fails", or "undecided" as long as nothing has happened that decides.

        At rest, the way tells a motion that stayed near from an avalanche: beyond the push by more than the push itself
        and by more than a tenth of the elastic strain. Beyond the limit of strain it has failed, unless its kinetic energy surely
        decays over the last half of the way; then it is followed on, to two and a half times the limit.
        """
        if self.calm >= CALM_LOOKS:
            is_long = self.beyond > max(self.norm, AVALANCHE * self.elastic_strain)
            return "arrested" if is_long else "settles"
        if abs(self.furthest) < self.strain_limit:
            return "undecided"
        if abs(self.furthest) < FAR * self.strain_limit and self.trend_on_way.surely_decays:
            return "undecided"
        return "fails"

    @property
    def trend_on_way(self) -> Trend:
        """Of the kinetic energy, since the strain was last below half of the largest."""
        short = np.flatnonzero(np.abs(self.strain) < 0.5 * abs(self.furthest))
        return self._since(int(short[-1]) + 1 if len(short) else 0)

    @property
    def trend_of_late(self) -> Trend:
        """Of the kinetic energy, over the last half of the time."""
        if not self.time:
            return self._since(0)
        middle = 0.5 * (self.time[0] + self.time[-1])
        return self._since(int(np.searchsorted(self.time, middle)))

    def _since(self, first: int) -> Trend:
        return trend(self.time[first:], self.kinetic[first:])
