"""Threads that step one assembly together. Their number changes no bit of a result."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.checks import whole_number
from rendulic.dem.kernels.arrays import BLOCK, Team, aligned

if TYPE_CHECKING:
    from rendulic.dem.assembly import Assembly

__all__ = ["team_for", "threads_for", "use_threads"]

GRAINS_PER_THREAD = 2000  # fewer spend their time waiting for each other
_asked: int | None = None
_pool: ThreadPoolExecutor | None = None


def use_threads(n: int | None) -> None:
    """How many threads step one assembly together; None (at first): one per core that this process may use.

    Only assemblies stepped in the main thread, and large enough to gain (2 000 grains per thread), are
    stepped by more than one. The number changes no result.

    Raises
    ------
    InvalidInput
        If it is not a positive whole number.
    """
    global _asked
    _asked = None if n is None else whole_number("number of threads", n, 1)


def threads_for(n_grains: int) -> int:
    """Threads that will step an assembly of so many grains, called from this thread."""
    if threading.current_thread() is not threading.main_thread():
        return 1  # probes and studies run in threads of their own, one per core already
    return max(1, min(_asked or _cores(), n_grains // GRAINS_PER_THREAD))


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def team_for(assembly: Assembly, n_threads: int) -> Team:
    """What so many threads share while they step an assembly with its present lists of contacts."""
    n, contacts, wall_contacts = len(assembly), assembly.contacts, assembly.wall_contacts
    n_contacts = len(contacts.first)
    # whole blocks, even in grains and contacts; a rank computes nearly the contacts that it adds to its grains
    grains_and_contacts = np.arange(n + 1) + np.searchsorted(contacts.first, np.arange(n + 1))
    even = np.searchsorted(grains_and_contacts, np.linspace(0, grains_and_contacts[-1], n_threads + 1))
    bounds = np.minimum(np.rint(even / BLOCK).astype(np.int64) * BLOCK, n)
    bounds[-1] = n
    own = np.searchsorted(contacts.first, bounds)
    computed = np.minimum(np.rint(own / BLOCK).astype(np.int64) * BLOCK, n_contacts)
    computed[-1] = n_contacts
    rank_of_first = np.searchsorted(bounds, contacts.first, side="right") - 1
    rank_of_second = np.searchsorted(bounds, contacts.second, side="right") - 1
    crossing = np.flatnonzero(rank_of_first != rank_of_second)
    crossing, crossing_start = _by_rank(crossing, rank_of_second[crossing], n_threads)
    at_walls = np.arange(len(wall_contacts.grain))
    at_walls, wall_start = _by_rank(at_walls, np.searchsorted(bounds, wall_contacts.grain, side="right") - 1, n_threads)
    return Team(
        grains=bounds,
        own=own,
        computed=computed,
        crossing=crossing,
        crossing_start=crossing_start,
        at_walls=at_walls,
        wall_start=wall_start,
        pair=aligned(8 * n_contacts).reshape(n_contacts, 8),
        wall_stiffness=np.zeros(len(wall_contacts.grain)),
        friction=np.zeros(-(-n_contacts // BLOCK)),
        damping=np.zeros(-(-n // BLOCK)),
        within=np.zeros(8 * n_threads, np.bool_),
        arrived=np.zeros(1, np.int64),
    )


def _by_rank(what: np.ndarray, rank: np.ndarray, n_ranks: int) -> tuple[np.ndarray, np.ndarray]:
    """Sorted by rank, otherwise in order, and where each rank begins."""
    order = np.argsort(rank, kind="stable")
    return what[order].astype(np.int32), np.searchsorted(rank[order], np.arange(n_ranks + 1))


def in_ranks(kernel: Callable[..., Any], n_threads: int, team: Team, *arguments):
    """Run `kernel(rank, n_threads, ...)` in all ranks at once; what rank 0 returned."""
    global _pool
    if _pool is None or _pool._max_workers < n_threads - 1:
        _pool = ThreadPoolExecutor(n_threads - 1, thread_name_prefix="rendulic")
    team.arrived[0] = 0
    others = [_pool.submit(kernel, rank, n_threads, *arguments, team) for rank in range(1, n_threads)]
    result = kernel(0, n_threads, *arguments, team)
    for other in others:
        other.result()
    return result


def _forget_pool() -> None:
    global _pool
    _pool = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
