"""How many cores this process may use."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from math import ceil
from pathlib import Path

from rendulic.foundation.checks import whole_number

__all__ = ["LIMITS", "cores", "workers_or_cores"]

# variables by which batch systems and people limit threads
LIMITS = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "SLURM_CPUS_PER_TASK")
GROUPS = Path("/proc/self/cgroup")
CONTROL = Path("/sys/fs/cgroup")


def cores() -> int:
    """The smallest of what the system, a container's quota and the environment allow; at least 1.

    1. The cores that this process may run on (`taskset`, SLURM).
    2. The share of time of its control groups (containers), rounded up.
    3. `OMP_NUM_THREADS`, `NUMBA_NUM_THREADS`, `SLURM_CPUS_PER_TASK`; what is no positive number there is passed over.

    >>> cores() >= 1
    True
    """
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min([own, *(ceil(share) for share in _quotas()), *_limits()]))


def workers_or_cores(workers: int | None) -> int:
    """`workers` if it is a whole number of at least 1; one for each core if it is None.

    Raises
    ------
    InvalidInput
        If it is another number.
    """
    return cores() if workers is None else whole_number("workers", workers, 1)


def _limits() -> Iterator[int]:
    for name in LIMITS:
        # OpenMP admits one number for each level of nesting
        text = os.environ.get(name, "").partition(",")[0].strip()
        if text.isascii() and text.isdigit() and int(text) > 0:
            yield int(text)


def _quotas() -> Iterator[float]:
    """Cores' worth of time that each control group above this process may use, of both versions of such groups."""
    try:
        lines = GROUPS.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return
    for line in lines:
        if line.count(":") < 2:
            continue
        _, controllers, own = line.split(":", 2)
        if controllers and "cpu" not in controllers.split(","):
            continue
        root = CONTROL / "cpu" if controllers else CONTROL
        place = root / own.strip("/")
        for folder in (place, *place.parents):
            if not folder.is_relative_to(root):
                break
            # a group without a quota says "max" or -1, or has no such file
            with suppress(OSError, ValueError, ZeroDivisionError):
                if controllers:
                    quota = float((folder / "cpu.cfs_quota_us").read_text())
                    period = float((folder / "cpu.cfs_period_us").read_text())
                else:
                    quota, period = map(float, (folder / "cpu.max").read_text().split())
                if quota > 0.0:
                    yield quota / period
