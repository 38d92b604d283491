"""How far beyond contact neighbours are listed, in mean radii; wide where grains travel, narrow where they rest."""

from __future__ import annotations

__all__ = ["AT_REST", "NEW", "narrowed", "widened"]

NEW = 0.05  # of an assembly just made
AT_REST = 0.02  # for small motions, as those of probes
SMALLEST, LARGEST = 0.005, 0.3
# rebuilding costs about 15 steps; a wide margin slows every step: aim at a list that holds so many steps
FEWEST_STEPS, MOST_STEPS = 150, 1500


def widened(margin: float, steps_since_build: int, mean_radius: float) -> float:
    """The margin in m of the next list, wider where the last one did not hold for long."""
    return float(min(1.5 * margin, LARGEST * mean_radius)) if steps_since_build < FEWEST_STEPS else margin


def narrowed(margin: float, steps_since_build: int, mean_radius: float) -> float:
    """The margin in m of the next list, narrower where the last one held for long."""
    return float(max(0.75 * margin, SMALLEST * mean_radius)) if steps_since_build > MOST_STEPS else margin
