"""What ends a step or a path, what is an event, and what is recorded: seen at one state, nothing is advanced."""

from __future__ import annotations

from math import sqrt

from rendulic.chang_hicher.kernels.arrays import CONSISTENT, LARGEST_CHANGE
from rendulic.chang_hicher.kernels.columns import EVENT, PLANE, PLANE_RECORD, RECORD, SHARED, STATE
from rendulic.foundation.compiling import kernel

__all__ = [
    "ENDS", "EVENTS", "LIMIT_SHARE", "TOLERATED", "add_event", "add_events", "add_record", "deviator", "end_of",
    "event_of", "have_changed", "least_slack", "monitors", "slack_of",
]  # fmt: skip

# why following stopped
FULL, TARGET, ETA, PEAK, UNCONTROLLED, LIMIT, TENSION, STUCK, AMBIGUOUS, STRAIN, NO_VOIDS, NO_FRICTION = range(12)
ENDS = ("full", "target", "eta", "peak", "loss of controllability", "plastic limit", "no stress left",
        "too many steps", "no consistent loading of the planes", "strain", "no voids left",
        "no critical void ratio left")  # fmt: skip
# what happened on the way: of the assembly, then of planes
W2_LOST, W2_REGAINED, Q_PEAK, PLANE_W2_LOST, PLANE_W2_REGAINED, PLANE_LIMIT, PLANE_UNLOADS, PLANE_RELOADS = range(8)
EVENTS = ("w2_lost", "w2_regained", "q_peak", "plane_w2_lost", "plane_w2_regained", "plane_limit",
          "plane_unloads", "plane_reloads")  # fmt: skip


N_ITEMS = 6  # that can shorten a step, before those of the planes
LIMIT_SHARE = 0.99  # of tan(phi_p): the hyperbola of Eq. 31 reaches 1 only after infinite sliding
TOLERATED = 1e-9  # excess over the surface, and loading measure, at which a plane changes sides
LEAST_VOID_RATIO = 0.02  # below, the grains would be one
LEAST_CRITICAL = 1e-3  # critical void ratio below which the planes have no friction left, to be divided by


@kernel
def mean(y):
    """p of a state."""
    return (y[0] + y[1] + y[2]) / 3.0


@kernel
def deviator(y):
    """q of a state."""
    return y[0] - 0.5 * (y[1] + y[2])


@kernel
def slack_of(item, problem, now, y, rate, scratch):
    """How far, as a number without dimension, a state is from one of the things that shorten a step; negative beyond.

    Items are those of the path, then three of every plane. The state is `y`, at its rate `rate`; `now` is where the
    step began.
    """
    if item < N_ITEMS:
        return slack_of_path(item, problem.ends, now.cursor[LARGEST_CHANGE], y, rate, scratch.shared, problem.control)
    a, which = (item - N_ITEMS) // 3, (item - N_ITEMS) % 3
    return slack_of_plane(which, scratch.plane[a], now.active[a], problem.ends.floor, problem.control.stress_scale)


@kernel
def slack_of_path(item, ends, largest_change, y, rate, shared, control):
    """That of loss of control, stress ratio, peak, strain, voids or critical void ratio."""
    if item == 0:
        return rate[STATE.parameter]
    if item == 1:
        return ends.eta_side * (ends.eta - deviator(y) / mean(y)) if ends.eta_side != 0.0 else 1.0
    if item == 2:
        # q has fallen by a share of its largest change
        if ends.drop > 0.0 and largest_change > 0.05 * mean(y):
            left = abs(deviator(y) - ends.q_start) - (1.0 - ends.drop) * largest_change
            return left / control.stress_scale
        return 1.0
    if item == 3:
        if ends.reach == 0.0:
            return 1.0
        travelled = 0.0
        for axis in range(3):
            if ends.reach_axis < 0 or ends.reach_axis == axis:
                travelled = max(travelled, abs(y[STATE.strain + axis] - ends.eps_start[axis]))
        return ends.reach - travelled
    if item == 4:
        return shared[SHARED.void_ratio] - LEAST_VOID_RATIO
    return shared[SHARED.critical_void_ratio] - LEAST_CRITICAL


@kernel
def slack_of_plane(which, row, is_loading, floor, stress_scale):
    """That of a plane: it changes sides, reaches its limit, or has no stress left."""
    if which == 0:
        return (row[PLANE.multiplier] if is_loading else -row[PLANE.excess]) + TOLERATED
    if which == 1:
        return 1.0 - 1e-6 - row[PLANE.x] if is_loading else 1.0
    return (row[PLANE.sigma] - floor) / stress_scale


@kernel
def end_of(item):
    """Why a path stops at an item; FULL if it does not."""
    if item == 0:
        return UNCONTROLLED
    if item < N_ITEMS:
        return (ETA, PEAK, STRAIN, NO_VOIDS, NO_FRICTION)[item - 1]
    which = (item - N_ITEMS) % 3
    return FULL if which == 0 else (LIMIT if which == 1 else TENSION)


@kernel
def least_slack(problem, now, y, rate, scratch):
    """The least slack and its item. The limit of Eq. 31 is out of reach of the consistent formulation."""
    least, least_item = 1e300, 0
    ends, control, active = problem.ends, problem.control, now.active
    for item in range(N_ITEMS):
        value = slack_of_path(item, ends, now.cursor[LARGEST_CHANGE], y, rate, scratch.shared, control)
        if value < least:
            least, least_item = value, item
    for a in range(active.shape[0]):
        for which in range(3):
            if which == 1 and problem.material.formulation == CONSISTENT:
                continue
            value = slack_of_plane(which, scratch.plane[a], active[a], ends.floor, control.stress_scale)
            if value < least:
                least, least_item = value, N_ITEMS + 3 * a + which
    return least, least_item


@kernel
def monitors(y, rate, scratch, out):
    """Values whose change of sign is an event: W2, growth of |q|, W2 of the planes, their distance to the limit.

    Those of the planes only if there is room for them.
    """
    n = scratch.plane.shape[0]
    w2 = 0.0
    for i in range(6):
        w2 += rate[i] * rate[STATE.strain + i]
    q, d_q = deviator(y), deviator(rate)
    out[0], out[1] = w2, (d_q if abs(q) < 1e-9 * abs(y[0]) or q > 0.0 else -d_q)
    for a in range(n if out.shape[0] > 2 else 0):
        out[2 + a] = scratch.plane[a, PLANE.w2]
        out[2 + n + a] = (
            LIMIT_SHARE - scratch.plane[a, PLANE.tau] / scratch.plane[a, PLANE.sigma] / scratch.shared[SHARED.tan_peak]
        )


@kernel
def event_of(index, n, falls):
    """Kind of event of a change of sign of monitor `index`; -1 where nobody asks."""
    if index == 0:
        return W2_LOST if falls else W2_REGAINED
    if index == 1:
        return Q_PEAK if falls else -1
    if index < 2 + n:
        return PLANE_W2_LOST if falls else PLANE_W2_REGAINED
    return PLANE_LIMIT if falls else -1


@kernel
def add_event(records, kind, plane, y):
    """Append an event, as long as there is room."""
    count = records.counts[1]
    if count < records.events.shape[0]:
        row = records.events[count]
        row[EVENT.kind], row[EVENT.plane] = kind, plane
        for i in range(y.shape[0]):
            row[EVENT.stress + i] = y[i]
        records.counts[1] = count + 1


@kernel
def add_events(records, before, after, y, n):
    """Append an event for every monitor that has changed sign."""
    for m in range(before.shape[0]):
        if (before[m] > 0.0) != (after[m] > 0.0):
            kind = event_of(m, n, before[m] > 0.0)
            if kind >= 0:
                add_event(records, kind, (m - 2) % n if m >= 2 else -1, y)


@kernel
def add_record(now, rate, scratch, records):
    """Append the present state and rates to the records."""
    count = records.counts[0]
    row = records.rows[count]
    for i in range(rate.shape[0]):
        row[RECORD.stress + i], row[RECORD.stress_rate + i] = now.y[i], rate[i]
    row[RECORD.determinant] = scratch.shared[SHARED.determinant]
    row[RECORD.tan_phi_p] = scratch.shared[SHARED.tan_peak]
    row[RECORD.void_ratio] = scratch.shared[SHARED.void_ratio]
    for a in range(now.active.shape[0]):
        plane, to = scratch.plane[a], records.plane_rows[count, a]
        to[PLANE_RECORD.sigma], to[PLANE_RECORD.tau], to[PLANE_RECORD.w2] = (
            plane[PLANE.sigma],
            plane[PLANE.tau],
            plane[PLANE.w2],
        )
        to[PLANE_RECORD.x] = plane[PLANE.tau] / plane[PLANE.sigma] / scratch.shared[SHARED.tan_peak]
        strain = now.plane_strain[a]
        to[PLANE_RECORD.eps] = strain[0]
        to[PLANE_RECORD.gamma] = sqrt(strain[1] ** 2 + strain[2] ** 2 + strain[3] ** 2)
        to[PLANE_RECORD.is_loading] = 1.0 if now.active[a] else 0.0
        sizes = plane[PLANE.sizes]
        to[PLANE_RECORD.w2_normalised] = plane[PLANE.w2] / sqrt(sizes) if sizes > 0.0 else 0.0
    for i in range(6):
        for j in range(6):
            records.compliances[count, i, j] = scratch.compliance[i, j]
    records.counts[0] = count + 1


@kernel
def have_changed(before, after):
    """Whether any monitor has changed sign."""
    for m in range(before.shape[0]):
        if (before[m] > 0.0) != (after[m] > 0.0):
            return True
    return False
