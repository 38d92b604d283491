"""What ends a step or a path, what is an event, and what is recorded: seen at one state, nothing is advanced."""

from __future__ import annotations

from rendulic.chang_hicher.kernels.arrays import (
    CONSISTENT,
    DETERMINANT,
    DROP,
    EPS_START,
    ETA_SIDE,
    EXCESS,
    FLOOR,
    LARGEST_CHANGE,
    MULTIPLIER,
    Q_START,
    REACH,
    REACH_AXIS,
    SIGMA,
    TAN_PEAK,
    TAU,
    UNTIL_ETA,
    VOID_RATIO,
    W2,
    W2_NORMALISED,
    X,
)
from rendulic.chang_hicher.kernels.compiler import jit

__all__ = [
    "ENDS",
    "EVENTS",
    "LIMIT_SHARE",
    "PLANE_COLUMNS",
    "RECORD_COLUMNS",
    "TOLERATED",
    "deviator",
    "end_of",
    "have_changed",
    "kind_of",
    "monitors",
    "note",
    "note_changes",
    "record",
    "slack_of",
    "tightest",
]

# why following stopped
FULL, TARGET, ETA, PEAK, UNCONTROLLED, LIMIT, TENSION, STUCK, AMBIGUOUS, STRAIN, NO_VOIDS = range(11)
ENDS = ("full", "target", "eta", "peak", "loss of controllability", "plastic limit", "no stress left",
        "too many steps", "no consistent loading of the planes", "strain", "no voids left")  # fmt: skip
# what happened on the way: of the assembly, then of planes
W2_LOST, W2_REGAINED, Q_PEAK, PLANE_W2_LOST, PLANE_W2_REGAINED, PLANE_LIMIT, PLANE_UNLOADS, PLANE_RELOADS = range(8)
EVENTS = ("w2_lost", "w2_regained", "q_peak", "plane_w2_lost", "plane_w2_regained", "plane_limit",
          "plane_unloads", "plane_reloads")  # fmt: skip


N_ITEMS = 5  # that can shorten a step, before those of the planes
LIMIT_SHARE = 0.99  # of tan(phi_p): the hyperbola of Eq. 31 reaches 1 only after infinite sliding
TOLERATED = 1e-9  # excess over the surface, and loading measure, at which a plane changes sides
LEAST_VOID_RATIO = 0.02  # below, the grains would be one
RECORD_COLUMNS = 29  # state (13), rates (13), determinant, tan(phi_p), void ratio
PLANE_COLUMNS = 10  # sigma, tau, x, W2, normal strain, shear strain (3), loading, normalised W2


@jit
def mean(y):
    """p of a state."""
    return (y[0] + y[1] + y[2]) / 3.0


@jit
def deviator(y):
    """q of a state."""
    return y[0] - 0.5 * (y[1] + y[2])


@jit
def slack_of(item, until, y, k_end, active, work, control):
    """How far, as a number without dimension, a state is from one of the things that shorten a step; negative beyond.

    Items are loss of control, stress ratio, peak, strain and voids, then three of every plane: it changes sides,
    reaches its limit, or has no stress left.
    """
    if item == 0:
        return k_end[12]
    if item == 1:
        return until[ETA_SIDE] * (until[UNTIL_ETA] - deviator(y) / mean(y)) if until[ETA_SIDE] != 0.0 else 1.0
    if item == 2:
        # q has fallen by a share of its largest change
        if until[DROP] > 0.0 and until[LARGEST_CHANGE] > 0.05 * mean(y):
            left = abs(deviator(y) - until[Q_START]) - (1.0 - until[DROP]) * until[LARGEST_CHANGE]
            return left / control.stress_scale
        return 1.0
    if item == 3:
        if until[REACH] == 0.0:
            return 1.0
        travelled = 0.0
        for axis in range(3):
            if until[REACH_AXIS] < 0.0 or until[REACH_AXIS] == axis:
                travelled = max(travelled, abs(y[6 + axis] - until[EPS_START + axis]))
        return until[REACH] - travelled
    if item == 4:
        return work.scalar[VOID_RATIO] - LEAST_VOID_RATIO
    a, which = (item - N_ITEMS) // 3, (item - N_ITEMS) % 3
    row = work.plane[a]
    if which == 0:
        return (row[MULTIPLIER] if active[a] else -row[EXCESS]) + TOLERATED
    if which == 1:
        return 1.0 - 1e-6 - row[X] if active[a] else 1.0
    return (row[SIGMA] - until[FLOOR]) / control.stress_scale


@jit
def end_of(item):
    """Why a path stops at an item; FULL if it does not."""
    if item == 0:
        return UNCONTROLLED
    if item < N_ITEMS:
        return (ETA, PEAK, STRAIN, NO_VOIDS)[item - 1]
    which = (item - N_ITEMS) % 3
    return FULL if which == 0 else (LIMIT if which == 1 else TENSION)


@jit
def tightest(until, y, k_end, active, work, control, formulation):
    """The least slack and its item. The limit of Eq. 31 is out of reach of the consistent formulation."""
    least, tight = 1e300, 0
    for item in range(N_ITEMS + 3 * active.shape[0]):
        if item >= N_ITEMS and (item - N_ITEMS) % 3 == 1 and formulation == CONSISTENT:
            continue
        value = slack_of(item, until, y, k_end, active, work, control)
        if value < least:
            least, tight = value, item
    return least, tight


@jit
def monitors(y, k_end, work, out):
    """Values whose change of sign is an event: W2, growth of |q|, W2 of the planes, their distance to the limit.

    Those of the planes only if there is room for them.
    """
    n = work.plane.shape[0]
    w2 = 0.0
    for i in range(6):
        w2 += k_end[i] * k_end[6 + i]
    q, d_q = deviator(y), deviator(k_end)
    out[0], out[1] = w2, (d_q if abs(q) < 1e-9 * abs(y[0]) or q > 0.0 else -d_q)
    for a in range(n if out.shape[0] > 2 else 0):
        out[2 + a] = work.plane[a, W2]
        out[2 + n + a] = LIMIT_SHARE - work.plane[a, TAU] / work.plane[a, SIGMA] / work.scalar[TAN_PEAK]


@jit
def kind_of(index, n, falls):
    """Kind of event of a change of sign of monitor `index`; -1 where nobody asks."""
    if index == 0:
        return W2_LOST if falls else W2_REGAINED
    if index == 1:
        return Q_PEAK if falls else -1
    if index < 2 + n:
        return PLANE_W2_LOST if falls else PLANE_W2_REGAINED
    return PLANE_LIMIT if falls else -1


@jit
def note(log, kind, plane, y):
    """Append an event, as long as there is room."""
    count = log.counts[1]
    if count < log.events.shape[0]:
        log.events[count, 0], log.events[count, 1] = kind, plane
        for i in range(13):
            log.events[count, 2 + i] = y[i]
        log.counts[1] = count + 1


@jit
def note_changes(log, before, after, y, n):
    """Note every monitor that has changed sign."""
    for m in range(before.shape[0]):
        if (before[m] > 0.0) != (after[m] > 0.0):
            kind = kind_of(m, n, before[m] > 0.0)
            if kind >= 0:
                note(log, kind, (m - 2) % n if m >= 2 else -1, y)


@jit
def record(y, rate, strains, active, work, log):
    """Write the present state and rates into the records."""
    count = log.counts[0]
    row = log.rows[count]
    for i in range(13):
        row[i], row[13 + i] = y[i], rate[i]
    row[26] = work.scalar[DETERMINANT]
    row[27] = work.scalar[TAN_PEAK]
    row[28] = work.scalar[VOID_RATIO]
    for a in range(active.shape[0]):
        plane, to = work.plane[a], log.plane_rows[count, a]
        to[0], to[1], to[3] = plane[SIGMA], plane[TAU], plane[W2]
        to[2] = plane[TAU] / plane[SIGMA] / work.scalar[TAN_PEAK]
        for i in range(4):
            to[4 + i] = strains[a, i]
        to[8], to[9] = (1.0 if active[a] else 0.0), plane[W2_NORMALISED]
    for i in range(6):
        for j in range(6):
            log.compliances[count, i, j] = work.compliance[i, j]
    log.counts[0] = count + 1


@jit
def have_changed(before, after):
    """Whether any monitor has changed sign."""
    for m in range(before.shape[0]):
        if (before[m] > 0.0) != (after[m] > 0.0):
            return True
    return False
