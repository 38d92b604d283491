"""Following a control: adaptive integration of order five, with every event located.

Dormand and Prince's pair of orders 5 and 4 (J. Comput. Appl. Math. 6 (1980) 19-26). Within a step the
set of loading planes is fixed; a step that ends with a plane unloading that should load, or the
reverse, is shortened to where that begins. So are steps beyond the end of the path, beyond a stress
ratio, and beyond the point where the control fails. All shortened steps are steps of the same formula
from the same start: an event is as exact as the integration.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from rendulic.chang_hicher.kernels.arrays import (
    CONSISTENT,
    EXCESS,
    KAPPA,
    LARGEST_CHANGE,
    MODULUS,
    Q_START,
    SIGMA,
    TAN_PEAK,
    Step,
)
from rendulic.chang_hicher.kernels.compiler import jit, jit_into_caller
from rendulic.chang_hicher.kernels.rates import VALID, rates, settle, sliding
from rendulic.chang_hicher.kernels.watch import (
    AMBIGUOUS,
    FULL,
    PLANE_RELOADS,
    PLANE_UNLOADS,
    STUCK,
    TARGET,
    TOLERATED,
    UNCONTROLLED,
    deviator,
    end_of,
    have_changed,
    kind_of,
    monitors,
    note,
    note_changes,
    record,
    slack_of,
    tightest,
)

__all__ = ["find_at_yield", "follow", "remember"]

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


@jit
def step(material, planes, control, y, h, memory, active, work, to):
    """One step of length `h` from `y`, whose rates are `to.k[0]`; returns the error, negative if inadmissible.

    `to` gets the state and the rates at the end, and the strains that the planes gained but for the
    share of the first stage.
    """
    n = active.shape[0]
    k, y1, local = to.k, to.y, to.local
    for a in range(n):
        for i in range(4):
            local[a, i] = 0.0
    for stage in range(1, 7):
        for i in range(13):
            value = 0.0
            for j in range(stage):
                value += TABLEAU[stage, j] * k[j, i]
            y1[i] = y[i] + h * value
        if rates(material, planes, control, y1[:6], y1[6:12], memory, active, work, k[stage]) != VALID:
            return -1.0
        weight = h * WEIGHTS[stage]
        if weight != 0.0:
            for a in range(n):
                for i in range(4):
                    local[a, i] += weight * work.local_rate[a, i]
    stress = 0.0
    for i in range(6):
        stress += y1[i] * y1[i]
    stress = sqrt(stress)
    worst = 0.0
    for i in range(12):
        error = 0.0
        for j in range(7):
            error += ERRORS[j] * k[j, i]
        worst = max(worst, abs(h * error) / (stress if i < 6 else control.strain_scale))
    return worst


@jit
def value_of(which, until, control, active, work, trial):
    """What a root is sought of at the end of a trial step: a monitor, what is left of the path, or a slack."""
    if which == OF_END:
        return 1.0 - trial.y[12]
    if which < OF_END:
        return slack_of(int(OF_SLACK - which), until, trial.y, trial.k[6], active, work, control)
    monitors(trial.y, trial.k[6], work, trial.values)
    return trial.values[int(which)]


@jit
def root(which, material, planes, control, until, y, h, memory, active, work, trial, f_low, f_high, tolerance):
    """The length of a step of at most `h` from `y` at whose end the value is zero; the trial is left there.

    Illinois' variant of the false position; a step that is not admissible counts as beyond.
    """
    low, high, side, length = 0.0, h, 0.0, h
    for _ in range(80):
        length = (low * f_high - high * f_low) / (f_high - f_low)
        if not low < length < high:
            length = 0.5 * (low + high)
        if step(material, planes, control, y, length, memory, active, work, trial) < 0.0:
            f = -abs(f_low) if f_low > 0.0 else abs(f_low)
        else:
            f = value_of(which, until, control, active, work, trial)
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
    step(material, planes, control, y, low, memory, active, work, trial)
    return low


@jit_into_caller
def locate_events(material, planes, control, until, y, h, memory, active, work, trial, before, after, log):
    """Note where in an accepted step the monitors that changed sign were zero, earliest first."""
    n, size = active.shape[0], before.shape[0]
    pending = np.zeros(size, dtype=np.bool_)
    for m in range(size):
        pending[m] = (before[m] > 0.0) != (after[m] > 0.0) and kind_of(m, n, before[m] > 0.0) >= 0
    while True:
        first, earliest = -1, 2.0
        for m in range(size):
            if pending[m] and before[m] / (before[m] - after[m]) < earliest:
                first, earliest = m, before[m] / (before[m] - after[m])
        if first < 0:
            return
        small = 1e-14 * max(abs(before[first]), abs(after[first]))
        root(float(first), material, planes, control, until, y, h, memory, active, work, trial, before[first], after[first],
             small)  # fmt: skip
        for m in range(size):
            # what vanishes with it is the same event: planes that a symmetry maps onto each other
            if m == first or (pending[m] and abs(trial.values[m]) <= 1e-8 * max(abs(before[m]), abs(after[m]))):
                pending[m] = False
                note(log, kind_of(m, n, before[m] > 0.0), (m - 2) % n if m >= 2 else -1, trial.y)


@jit
def remember(material, active, work, memory):
    """Store on loading planes what the present stress has mobilised."""
    for a in range(active.shape[0]):
        if active[a]:
            row = work.plane[a]
            if material.formulation == CONSISTENT:
                memory[a] = sliding(row[KAPPA], row[SIGMA], material.k_pR * row[MODULUS], work.scalar[TAN_PEAK])
            else:
                memory[a] = row[KAPPA]


@jit
def find_at_yield(work, active, at_yield):
    """Planes whose stress lies on their surface."""
    for a in range(active.shape[0]):
        at_yield[a] = active[a] or work.plane[a, EXCESS] >= -TOLERATED


@jit_into_caller
def start(material, planes, control, y, memory, active, at_yield, work, rate):
    """Loading planes and rates at the start of a path."""
    for a in range(active.shape[0]):
        active[a] = False
    status = rates(material, planes, control, y[:6], y[6:12], memory, active, work, rate)
    if status != VALID:
        return AMBIGUOUS
    find_at_yield(work, active, at_yield)
    if settle(material, planes, control, y[:6], y[6:12], memory, at_yield, active, work, rate) != VALID:
        return AMBIGUOUS
    return FULL


@jit
def follow(material, planes, control, until, settings, y, strains, memory, active, cursor, work, log):
    """Integrate from `y` to parameter 1 or to what stops the path, in place; returns why it stopped.

    Parameters
    ----------
    until : (N_UNTIL,) array
        What ends the path, see `arrays`.
    settings : (4,) array
        Error tolerated per step, largest step of the parameter, first step, whether to watch the planes.
    y : (13,) array
        Stress, strain, parameter.
    strains : (n, 4) array
        Normal and shear strains of the planes.
    memory : (n,) array
        Hardening of the planes.
    active : (n,) bool array
        Planes that load.
    cursor : (2,) array
        Step to go on with, 0 at the start of a path; steps tried so far.
    log : Log
        Room for records and events; when it is full, so is what is returned, and a second call goes on.
    """
    n = active.shape[0]
    n_watched = 2 + 2 * n if settings[3] > 0.0 else 2
    main, trial = scratch(n, n_watched), scratch(n, n_watched)
    k = main.k
    before, after = np.zeros(n_watched), np.zeros(n_watched)
    at_yield, was_active = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    tolerance, largest = settings[0], settings[1]
    if cursor[0] == 0.0:
        status = start(material, planes, control, y, memory, active, at_yield, work, k[0])
        if status != FULL:
            return status
        record(y, k[0], strains, active, work, log)
        cursor[0] = settings[2]
    else:
        rates(material, planes, control, y[:6], y[6:12], memory, active, work, k[0])
    if k[0, 12] <= 0.0:
        return UNCONTROLLED
    monitors(y, k[0], work, before)
    h = cursor[0]
    stalls = 0
    first_local = np.zeros((n, 4))
    copy_rows(first_local, work.local_rate)
    while True:
        if log.counts[0] >= log.rows.shape[0] - 1 or log.counts[1] > log.events.shape[0] - 6 * n - 6:
            cursor[0] = h
            return FULL
        cursor[1] += 1.0
        if cursor[1] > MOST_STEPS:
            return STUCK
        length = min(h, largest / k[0, 12])
        error = step(material, planes, control, y, length, memory, active, work, main)
        if error < 0.0 or error > tolerance:
            h = 0.25 * length if error < 0.0 else length * max(0.2, 0.9 * (tolerance / error) ** 0.2)
            if h < 1e-13:
                return STUCK
            continue
        grown = length * min(5.0, 0.9 * (tolerance / max(error, 1e-30)) ** 0.2)
        lands = main.y[12] >= 1.0
        if lands:
            length = root(OF_END, material, planes, control, until, y, length, memory, active, work, main,
                          1.0 - y[12], 1.0 - main.y[12], 3e-16)  # fmt: skip
        left, item = tightest(until, main.y, k[6], active, work, control, material.formulation)
        shortened, end = left < 0.0, FULL
        if shortened:
            lands = False
            # to the root of the tightest item's own slack; then another one may be the tightest
            for _ in range(MOST_STALLS):
                if left >= -0.01 * TOLERATED:
                    break
                rates(material, planes, control, y[:6], y[6:12], memory, active, work, k[0])
                room = max(slack_of(item, until, y, k[0], active, work, control), 0.1 * TOLERATED)
                length = root(OF_SLACK - item, material, planes, control, until, y, length, memory, active, work, main,
                              room, left, 0.01 * TOLERATED)  # fmt: skip
                end = end_of(item)
                left, item = tightest(until, main.y, k[6], active, work, control, material.formulation)
        monitors(main.y, k[6], work, after)
        if have_changed(before, after):
            copy(trial.k[0], k[0])
            locate_events(material, planes, control, until, y, length, memory, active, work, trial, before, after, log)
            rates(material, planes, control, main.y[:6], main.y[6:12], memory, active, work, k[6])
        # accept; `step` leaves the share of the first stage in the planes' strains to its caller
        for a in range(n):
            for i in range(4):
                strains[a, i] += main.local[a, i] + length * WEIGHTS[0] * first_local[a, i]
        copy(y, main.y)
        copy(k[0], k[6])
        if lands:
            y[12] = 1.0
        remember(material, active, work, memory)
        until[LARGEST_CHANGE] = max(until[LARGEST_CHANGE], abs(deviator(y) - until[Q_START]))
        h = grown
        status = VALID
        if shortened and end == FULL:
            # on record twice: with the rates before, and those after
            record(y, k[0], strains, active, work, log)
            copy(was_active, active)
            find_at_yield(work, active, at_yield)
            status = settle(material, planes, control, y[:6], y[6:12], memory, at_yield, active, work, k[0])
            if status == VALID:
                for a in range(n):
                    if was_active[a] != active[a] and n_watched > 2:
                        note(log, PLANE_UNLOADS if was_active[a] else PLANE_RELOADS, a, y)
                copy(before, after)
                monitors(y, k[0], work, after)
                note_changes(log, before, after, y, n)
            h = min(h, 4.0 * length + 1e-6)
        copy(before, after)
        copy_rows(first_local, work.local_rate)
        record(y, k[0], strains, active, work, log)
        if lands:
            return TARGET
        if shortened and end != FULL:
            return end
        stalls = stalls + 1 if shortened and length < 1e-14 else 0
        if stalls > MOST_STALLS:
            return AMBIGUOUS
        if status != VALID:
            return AMBIGUOUS
        if k[0, 12] <= 0.0:
            return UNCONTROLLED


@jit
def copy(to, values):
    """Copy, element by element: an assignment of slices takes seconds to compile."""
    for i in range(to.shape[0]):
        to[i] = values[i]


@jit
def copy_rows(to, values):
    """Copy row by row."""
    for i in range(to.shape[0]):
        for j in range(to.shape[1]):
            to[i, j] = values[i, j]


@jit
def scratch(n, n_watched):
    """Room for one step."""
    return Step(np.zeros((7, 13)), np.zeros(13), np.zeros((n, 4)), np.zeros(n_watched))
