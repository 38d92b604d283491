"""Threads that step one assembly together. Their number changes no bit of a result."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from rendulic.dem.kernels.arrays import BLOCK, CACHE_LINE, Contacts, Team
from rendulic.dem.state.assembly_state import AssemblyState
from rendulic.foundation.checks import whole_number
from rendulic.foundation.cores import cores

__all__ = ["Prepared", "in_ranks", "prepared_for", "threads_for", "use_threads"]

GRAINS_PER_THREAD = 2000  # fewer spend their time waiting for each other
_asked: int | None = None
_pool: ThreadPoolExecutor | None = None
_prepared: WeakKeyDictionary[AssemblyState, Prepared] = WeakKeyDictionary()


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
    return max(1, min(_asked or cores(), n_grains // GRAINS_PER_THREAD))


class Prepared(NamedTuple):
    """What threads were prepared for, and with."""

    contacts: Contacts
    n_threads: int
    team: Team
    crossing: tuple[Contacts, ...]  # of each rank: other ranks' contacts with its grains, before its own and after
    places: tuple[np.ndarray, ...]  # where these are in `contacts`

    def is_for(self, contacts: Contacts, n_threads: int) -> bool:
        return self.contacts is contacts and self.n_threads == n_threads


def prepared_for(assembly: AssemblyState, n_threads: int) -> Prepared:
    """What so many threads need for the present lists of an assembly; kept until its lists change."""
    ready = _prepared.get(assembly)
    if ready is None or not ready.is_for(assembly.contacts, n_threads):
        ready = _prepared[assembly] = share_out(assembly, n_threads)
    return ready


def share_out(assembly: AssemblyState, n_threads: int) -> Prepared:
    """Give every thread its share of an assembly's grains and contacts, as its lists are now."""
    n, contacts, wall_contacts = len(assembly), assembly.contacts, assembly.wall_contacts
    # whole blocks, even in grains and contacts
    work = np.arange(n + 1) + np.searchsorted(contacts.first, np.arange(n + 1))
    even = np.searchsorted(work, np.linspace(0, work[-1], n_threads + 1))
    bounds = np.minimum(np.rint(even / BLOCK).astype(np.int64) * BLOCK, n)
    bounds[-1] = n
    computed = np.rint(np.searchsorted(contacts.first, bounds) / BLOCK).astype(np.int64) * BLOCK
    computed = np.minimum(computed, len(contacts.first))
    computed[-1] = len(contacts.first)
    places = []
    for rank in range(n_threads):
        low, high = bounds[rank], bounds[rank + 1]
        of_rank = ((contacts.first >= low) & (contacts.first < high)) | (
            (contacts.second >= low) & (contacts.second < high)
        )
        places.append(np.flatnonzero(of_rank[: computed[rank]]))
        places.append(computed[rank + 1] + np.flatnonzero(of_rank[computed[rank + 1] :]))
    rank_of_wall_contact = np.searchsorted(bounds, wall_contacts.grain, side="right") - 1
    at_walls = np.argsort(rank_of_wall_contact, kind="stable")
    n_blocks = -(-len(contacts.first) // BLOCK)
    team = Team(
        grains=bounds,
        contacts=computed,
        at_walls=at_walls,
        wall_start=np.searchsorted(rank_of_wall_contact[at_walls], np.arange(n_threads + 1)),
        wall_stiffness=np.zeros(len(wall_contacts.grain)),
        again=np.zeros((n_threads, n_blocks)),
        friction=np.zeros(n_blocks),
        damping=np.zeros(-(-n // BLOCK)),
        within=np.zeros(CACHE_LINE * n_threads, np.bool_),
        arrived=np.zeros(1, np.int64),
    )
    crossing = tuple(Contacts(contacts.first[at], contacts.second[at], contacts.force[at]) for at in places)
    return Prepared(contacts, n_threads, team, crossing, tuple(places))


def in_ranks(kernel: Callable[..., Any], ready: Prepared, *arguments):
    """Run `kernel(rank, n_threads, ..., team, crossing)` in all ranks at once; what rank 0 returned."""
    global _pool
    n, team, crossing = ready.n_threads, ready.team, ready.crossing
    if _pool is None or _pool._max_workers < n - 1:
        _pool = ThreadPoolExecutor(n - 1, thread_name_prefix="rendulic")
    for own, places in zip(crossing, ready.places, strict=True):
        own.force[:] = ready.contacts.force[places]
    team.arrived[0] = 0
    others = [_pool.submit(kernel, rank, n, *arguments, team, crossing) for rank in range(1, n)]
    result = kernel(0, n, *arguments, team, crossing)
    for other in others:
        other.result()
    return result


def _forget_pool() -> None:
    global _pool
    _pool = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
