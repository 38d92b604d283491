"""Following a control: adaptive integration of order five, with every event located.

Dormand and Prince's pair of orders 5 and 4 (J. Comput. Appl. Math. 6 (1980) 19-26). Within a step the
set of loading planes is fixed; a step that ends with a plane unloading that should load, or the
reverse, is shortened to where that begins. So are steps beyond the end of the path, beyond a stress
ratio, and beyond the point where the control fails. All shortened steps are steps of the same formula
from the same start: they end as exactly as the integration goes. What happens without a change of the
rates (a monitor changes sign) is found within the step, with an interpolation of order four.
"""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from rendulic.chang_hicher.kernels.arrays import CONSISTENT, LARGEST_CHANGE, N_TRIED, NEXT_STEP, Trial
from rendulic.chang_hicher.kernels.columns import PLANE, SHARED, STATE
from rendulic.chang_hicher.kernels.events import (
    AMBIGUOUS,
    FULL,
    PLANE_RELOADS,
    PLANE_UNLOADS,
    STUCK,
    TARGET,
    TOLERATED,
    UNCONTROLLED,
    add_event,
    add_events,
    add_record,
    deviator,
    end_of,
    event_of,
    have_changed,
    least_slack,
    monitors,
    slack_of,
)
from rendulic.chang_hicher.kernels.rates import VALID, find_loading_planes, rates, sliding
from rendulic.foundation.compiling import kernel

__all__ = ["find_at_yield", "follow", "remember"]

N_STATE = STATE.parameter + 1  # entries of a state
# what a root is sought of: a monitor by its index, the end, or OF_SLACK - item; floats: one compilation for all
OF_END, OF_SLACK = -1.0, -2.0

MOST_STEPS = 50_000  # of a path, also those that were rejected
MOST_STALLS = 20  # times that a step may end where it began


A2 = (1 / 5,)
A3 = (3 / 40, 9 / 40)
A4 = (44 / 45, -56 / 15, 32 / 9)
A5 = (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729)
A6 = (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656)
A7 = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
DIFFERENCE = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
TABLEAU = np.zeros((7, 7))
for _row, _values in enumerate((A2, A3, A4, A5, A6, A7), start=1):
    TABLEAU[_row, : len(_values)] = _values
WEIGHTS = np.array((*A7, 0.0))
ERRORS = np.array(DIFFERENCE)
# of order four within the step, from the same stages (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.6)
WITHIN = np.array((
    -12715105075 / 11282082432, 0.0, 87487479700 / 32700410799, -10690763975 / 1880347072, 701980252875 / 199316789632,
    -1453857185 / 822651844, 69997945 / 29380423,
))  # fmt: skip


@kernel(inline="always")
def rates_at(problem, y, now, scratch, out):
    """`rates` of a state `y`, with memory and loading planes as they are now."""
    return rates(
        problem.material, problem.planes, problem.control, y[: STATE.strain], y[STATE.strain : STATE.parameter],
        now.memory, now.active, scratch, out,
    )  # fmt: skip


@kernel
def step(problem, now, h, scratch, to):
    """One step of length `h` from `now`, whose rates are `to.k[0]`; returns the error, negative if inadmissible.

    `to` gets the state and the rates at the end, and the strains that the planes gained but for the
    share of the first stage.
    """
    n = now.active.shape[0]
    k, y1, local = to.k, to.y, to.local
    for a in range(n):
        for i in range(4):
            local[a, i] = 0.0
    for stage in range(1, 7):
        for i in range(N_STATE):
            value = 0.0
            for j in range(stage):
                value += TABLEAU[stage, j] * k[j, i]
            y1[i] = now.y[i] + h * value
        if rates_at(problem, y1, now, scratch, k[stage]) != VALID:
            return -1.0
        weight = h * WEIGHTS[stage]
        if weight != 0.0:
            for a in range(n):
                for i in range(4):
                    local[a, i] += weight * scratch.local_rate[a, i]
    stress = 0.0
    for i in range(STATE.strain):
        stress += y1[i] * y1[i]
    stress = sqrt(stress)
    worst = 0.0
    for i in range(STATE.parameter):
        error = 0.0
        for j in range(7):
            error += ERRORS[j] * k[j, i]
        worst = max(worst, abs(h * error) / (stress if i < STATE.strain else problem.control.strain_scale))
    return worst


@kernel
def value_within(which, share, problem, now, h, scratch, taken, spare):
    """What a root is sought of, at a share of a step that was taken; NaN where the state is not valid.

    The state follows from the stages of the step; it, its rates and monitors are left in `spare`. At the end of the step
    (share 1) they are those of `taken`, and `scratch` must be, too.
    """
    if share == 1.0:
        if which == OF_END:
            return 1.0 - taken.y[STATE.parameter]
        return slack_of(int(OF_SLACK - which), problem, now, taken.y, taken.k[6], scratch)
    k = taken.k
    for i in range(N_STATE):
        whole = taken.y[i] - now.y[i]
        bend = h * k[0, i] - whole
        high = 0.0
        for j in range(7):
            high += WITHIN[j] * k[j, i]
        inner = whole - h * k[6, i] - bend + (1.0 - share) * h * high
        spare.y[i] = now.y[i] + share * (whole + (1.0 - share) * (bend + share * inner))
    if which == OF_END:
        return 1.0 - spare.y[STATE.parameter]
    if rates_at(problem, spare.y, now, scratch, spare.k[6]) != VALID:
        return np.nan
    if which < OF_END:
        return slack_of(int(OF_SLACK - which), problem, now, spare.y, spare.k[6], scratch)
    monitors(spare.y, spare.k[6], scratch, spare.values)
    return spare.values[int(which)]


@kernel
def root_within(which, problem, now, h, scratch, taken, spare, f_low, f_high, tolerance):
    """The share of a step that was taken at which the value is zero; `spare` is left there.

    Illinois' variant of the false position; a state that is not valid counts as beyond.
    """
    low, high, side, share = 0.0, 1.0, 0.0, 1.0
    for _ in range(80):
        share = (low * f_high - high * f_low) / (f_high - f_low)
        if not low < share < high:
            share = 0.5 * (low + high)
        f = value_within(which, share, problem, now, h, scratch, taken, spare)
        if not isfinite(f):
            f = -f_low
        if abs(f) <= tolerance or high - low < 1e-15:
            break
        if (f > 0.0) == (f_low > 0.0):
            low, f_low = share, f
            if side < 0.0:
                f_high *= 0.5
            side = -1.0
        else:
            high, f_high = share, f
            if side > 0.0:
                f_low *= 0.5
            side = 1.0
    return share


@kernel
def root(which, problem, now, h, scratch, taken, spare, f_low, f_high, tolerance):
    """The length of a step from `now`, at most that of the step of length `h` that was taken, at whose end the value is zero.

    The step is left in `taken`. It is sought within the step first, where a value costs a sixth of a step; then come steps of
    their own, the second one by the slope found there, the others by the false position (Illinois). A step that is not
    admissible counts as beyond.
    """
    rough = 1e-7 * max(abs(f_low), abs(f_high))
    share = root_within(which, problem, now, h, scratch, taken, spare, f_low, f_high, rough)
    nearer = min(1e-3, 0.5 * share)
    slope = 0.0
    for sign in (-1.0, 1.0):
        place = share if sign > 0.0 else share - nearer
        slope += sign * value_within(which, place, problem, now, h, scratch, taken, spare) / (h * nearer)
    low, high, side, length, f = 0.0, h, 0.0, share * h, 0.0
    for attempt in range(80):
        if attempt == 1:
            length -= f / slope
        elif attempt > 1:
            length = (low * f_high - high * f_low) / (f_high - f_low)
        if not low < length < high:
            length = 0.5 * (low + high)
        if step(problem, now, length, scratch, taken) < 0.0:
            f = -abs(f_low) if f_low > 0.0 else abs(f_low)
        else:
            f = value_within(which, 1.0, problem, now, h, scratch, taken, spare)
        if abs(f) <= tolerance:
            return length
        if high - low < 1e-15 * h:
            break
        if (f > 0.0) == (f_low > 0.0):
            low, f_low = length, f
            if side < 0.0:
                f_high *= 0.5
            side = -1.0
        else:
            high, f_high = length, f
            if side > 0.0:
                f_low *= 0.5
            side = 1.0
    # a jump, not a root: stay before it
    step(problem, now, low, scratch, taken)
    return low


@kernel(inline="always")
def locate_events(problem, now, h, scratch, taken, trial, before, after, records):
    """Add where in a step that was taken the monitors that changed sign were zero, earliest first."""
    n, size = now.active.shape[0], before.shape[0]
    pending = np.zeros(size, dtype=np.bool_)
    for m in range(size):
        pending[m] = (before[m] > 0.0) != (after[m] > 0.0) and event_of(m, n, before[m] > 0.0) >= 0
    while True:
        first, earliest = -1, 2.0
        for m in range(size):
            if pending[m] and before[m] / (before[m] - after[m]) < earliest:
                first, earliest = m, before[m] / (before[m] - after[m])
        if first < 0:
            return
        small = 1e-14 * max(abs(before[first]), abs(after[first]))
        root_within(float(first), problem, now, h, scratch, taken, trial, before[first], after[first], small)
        for m in range(size):
            # what vanishes with it is the same event: planes that a symmetry maps onto each other
            if m == first or (pending[m] and abs(trial.values[m]) <= 1e-8 * max(abs(before[m]), abs(after[m]))):
                pending[m] = False
                add_event(records, event_of(m, n, before[m] > 0.0), (m - 2) % n if m >= 2 else -1, trial.y)


@kernel
def remember(material, active, scratch, memory):
    """Store on loading planes what the present stress has mobilised."""
    for a in range(active.shape[0]):
        if active[a]:
            row = scratch.plane[a]
            if material.formulation == CONSISTENT:
                tan_peak = scratch.shared[SHARED.tan_peak]
                memory[a] = sliding(row[PLANE.kappa], row[PLANE.sigma], material.k_pR * row[PLANE.modulus], tan_peak)
            else:
                memory[a] = row[PLANE.kappa]


@kernel
def find_at_yield(scratch, active, at_yield):
    """Planes whose stress lies on their surface."""
    for a in range(active.shape[0]):
        at_yield[a] = active[a] or scratch.plane[a, PLANE.excess] >= -TOLERATED


@kernel(inline="always")
def find_loading(problem, now, at_yield, scratch, rate):
    """`find_loading_planes` at the present state."""
    return find_loading_planes(
        problem.material, problem.planes, problem.control, now.y[: STATE.strain],
        now.y[STATE.strain : STATE.parameter], now.memory, at_yield, now.active, scratch, rate,
    )  # fmt: skip


@kernel(inline="always")
def start(problem, now, at_yield, scratch, rate):
    """Loading planes and rates at the start of a path."""
    for a in range(now.active.shape[0]):
        now.active[a] = False
    if rates_at(problem, now.y, now, scratch, rate) != VALID:
        return AMBIGUOUS
    find_at_yield(scratch, now.active, at_yield)
    if find_loading(problem, now, at_yield, scratch, rate) != VALID:
        return AMBIGUOUS
    return FULL


@kernel
def follow(problem, settings, now, scratch, records):
    """Integrate to parameter 1 or to what stops the path, in place; returns why it stopped.

    Parameters
    ----------
    problem : Problem
        Material, planes, control, and what ends the path.
    settings : Settings
        Tolerance and steps.
    now : PathState
        Where the path starts, or where the last call left it.
    scratch : Scratch
        Room.
    records : Records
        Room for records and events; when it is full, so is what is returned, and a second call goes on.
    """
    y, active, cursor = now.y, now.active, now.cursor
    n = active.shape[0]
    n_watched = 2 + 2 * n if settings.watches_planes else 2
    main, trial = new_trial(n, n_watched), new_trial(n, n_watched)
    k = main.k
    before, after = np.zeros(n_watched), np.zeros(n_watched)
    at_yield, was_active = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    tolerance, largest = settings.tolerance, settings.largest_step
    if cursor[NEXT_STEP] == 0.0:
        status = start(problem, now, at_yield, scratch, k[0])
        if status != FULL:
            return status
        add_record(now, k[0], scratch, records)
        cursor[NEXT_STEP] = settings.first_step
    else:
        rates_at(problem, y, now, scratch, k[0])
    if k[0, STATE.parameter] <= 0.0:
        return UNCONTROLLED
    monitors(y, k[0], scratch, before)
    h = cursor[NEXT_STEP]
    stalls = 0
    first_local = np.zeros((n, 4))
    copy_rows(first_local, scratch.local_rate)
    while True:
        if records.counts[0] >= records.rows.shape[0] - 1 or records.counts[1] > records.events.shape[0] - 6 * n - 6:
            cursor[NEXT_STEP] = h
            return FULL
        cursor[N_TRIED] += 1.0
        if cursor[N_TRIED] > MOST_STEPS:
            return STUCK
        length = min(h, largest / k[0, STATE.parameter])
        error = step(problem, now, length, scratch, main)
        if error < 0.0 or error > tolerance:
            h = 0.25 * length if error < 0.0 else length * max(0.2, 0.9 * (tolerance / error) ** 0.2)
            if h < 1e-13:
                return STUCK
            continue
        grown = length * min(5.0, 0.9 * (tolerance / max(error, 1e-30)) ** 0.2)
        lands = main.y[STATE.parameter] >= 1.0
        if lands:
            left, beyond = 1.0 - y[STATE.parameter], 1.0 - main.y[STATE.parameter]
            length = root(OF_END, problem, now, length, scratch, main, trial, left, beyond, 3e-16)
        left, item = least_slack(problem, now, main.y, k[6], scratch)
        shortened, end = left < 0.0, FULL
        if shortened:
            lands = False
            # to the root of this item's own slack; then another one may be the least
            for _ in range(MOST_STALLS):
                if left >= -0.01 * TOLERATED:
                    break
                rates_at(problem, y, now, scratch, k[0])
                room = max(slack_of(item, problem, now, y, k[0], scratch), 0.1 * TOLERATED)
                length = root(OF_SLACK - item, problem, now, length, scratch, main, trial, room, left, 0.01 * TOLERATED)
                end = end_of(item)
                left, item = least_slack(problem, now, main.y, k[6], scratch)
        monitors(main.y, k[6], scratch, after)
        if have_changed(before, after):
            locate_events(problem, now, length, scratch, main, trial, before, after, records)
            rates_at(problem, main.y, now, scratch, k[6])
        # accept; `step` leaves the share of the first stage in the planes' strains to its caller
        for a in range(n):
            for i in range(4):
                now.plane_strain[a, i] += main.local[a, i] + length * WEIGHTS[0] * first_local[a, i]
        copy(y, main.y)
        copy(k[0], k[6])
        if lands:
            y[STATE.parameter] = 1.0
        remember(problem.material, active, scratch, now.memory)
        cursor[LARGEST_CHANGE] = max(cursor[LARGEST_CHANGE], abs(deviator(y) - problem.ends.q_start))
        h = grown
        status = VALID
        if shortened and end == FULL:
            # on record twice: with the rates before, and those after
            add_record(now, k[0], scratch, records)
            copy(was_active, active)
            find_at_yield(scratch, active, at_yield)
            status = find_loading(problem, now, at_yield, scratch, k[0])
            if status == VALID:
                for a in range(n):
                    if was_active[a] != active[a] and n_watched > 2:
                        add_event(records, PLANE_UNLOADS if was_active[a] else PLANE_RELOADS, a, y)
                copy(before, after)
                monitors(y, k[0], scratch, after)
                add_events(records, before, after, y, n)
            h = min(h, 4.0 * length + 1e-6)
        copy(before, after)
        copy_rows(first_local, scratch.local_rate)
        add_record(now, k[0], scratch, records)
        if lands:
            return TARGET
        if shortened and end != FULL:
            return end
        stalls = stalls + 1 if shortened and length < 1e-14 else 0
        if stalls > MOST_STALLS:
            return AMBIGUOUS
        if status != VALID:
            return AMBIGUOUS
        if k[0, STATE.parameter] <= 0.0:
            return UNCONTROLLED


@kernel
def copy(to, values):
    """Copy, element by element: an assignment of slices takes seconds to compile."""
    for i in range(to.shape[0]):
        to[i] = values[i]


@kernel
def copy_rows(to, values):
    """Copy row by row."""
    for i in range(to.shape[0]):
        for j in range(to.shape[1]):
            to[i, j] = values[i, j]


@kernel
def new_trial(n, n_watched):
    """Room for one step."""
    return Trial(np.zeros((7, N_STATE)), np.zeros(N_STATE), np.zeros((n, 4)), np.zeros(n_watched))
