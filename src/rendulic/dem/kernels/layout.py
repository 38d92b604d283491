"""Where everything lies in the arrays and on the stack of the kernels of grains: the one place that says it.

Two layouts hold a grain. `GRAIN`: its row of 128 bytes, two cache lines, in an assembly. `LANE`: its rows when several
copies of an assembly advance together; each of these rows has one number per lane.
"""

from __future__ import annotations

from rendulic.foundation.columns import places, width

__all__ = [
    "CONTACT", "CONTACT_COLUMNS", "CONTACT_STACK", "GRAIN", "GRAIN_COLUMNS", "GRAIN_READ", "HALF_GRAIN", "LANE",
    "LANE_CONTACT_STACK", "LANE_MOVE_STACK", "LANE_ROWS", "LANE_STACKED", "LANE_WALL_STACK", "MOVE_STACK",
    "N_CONTACT", "N_CONTACT_STACK", "N_GRAIN", "N_LANE", "N_MOVE_STACK", "N_PAIR", "N_SERVO", "PAIR", "PAIR_COLUMNS",
    "SERVO", "SPENT",
]  # fmt: skip

# -- arrays ----------------------------------------------------------------------------------------

# of a grain: `Grains.row`
GRAIN_COLUMNS = {"position": 3, "radius": 1, "velocity": 3, "spin": 3, "force": 3, "torque": 3}
GRAIN, N_GRAIN = places("GrainColumns", GRAIN_COLUMNS), width(GRAIN_COLUMNS)
HALF_GRAIN = N_GRAIN // 2  # one cache line
GRAIN_READ = GRAIN.force  # numbers that a contact reads of a grain: all before

# of a contact: `Contacts.force`
CONTACT_COLUMNS = {"force_n": 1, "force_t": 3}
CONTACT, N_CONTACT = places("ContactColumns", CONTACT_COLUMNS), width(CONTACT_COLUMNS)

# of what a contact does to its two grains, kept until it is added to them: arms, force on the second, moment
PAIR_COLUMNS = {"arm_1": 1, "arm_2": 1, "force": 3, "moment": 3}
PAIR, N_PAIR = places("PairColumns", PAIR_COLUMNS), width(PAIR_COLUMNS)

# of a grain in lanes: rows of its part of `LaneArrays.state`; where it was when the list was made comes last
LANE_ROWS = {"position": 3, "velocity": 3, "spin": 3, "force": 3, "torque": 3, "origin": 3}
LANE, N_LANE = places("LaneRows", LANE_ROWS), width(LANE_ROWS)

# of the energies spent, J
SPENT = places("Spent", {"friction": 1, "damping": 1, "boundary": 1})

# of the servo's (6, 3) room: a linear system, its solution, and how far the walls of an axis moved inward
SERVO_ROWS = {"matrix": 3, "right": 1, "rates": 1, "inward": 1}
SERVO, N_SERVO = places("ServoRows", SERVO_ROWS), width(SERVO_ROWS)

# -- rows on the stack, each with one number per contact or grain of a pack, or per lane --------------

# contacts in packs: both grains, history before and now, what goes to the grains, what friction took, the normal
# force of pairs that opened
_CONTACT_STACK = {
    "first": GRAIN_READ, "second": GRAIN_READ, "held": N_CONTACT, "now": N_CONTACT, "pair": N_PAIR, "slid": 1,
    "opened": 1,
}  # fmt: skip
CONTACT_STACK, N_CONTACT_STACK = places("ContactStack", _CONTACT_STACK), width(_CONTACT_STACK)

# moving grains in packs: the whole row, where the list was made, how far it is from there, squared, and what damping took
_MOVE_STACK = {"row": N_GRAIN, "origin": 3, "mass": 1, "inertia": 1, "moved2": 1, "taken": 1}
MOVE_STACK, N_MOVE_STACK = places("MoveStack", _MOVE_STACK), width(_MOVE_STACK)

# a contact in lanes: both grains (of the second, the position from the first), history, distance squared
_LANE_CONTACT_STACK = {"first": LANE.origin, "second": LANE.origin, "held": N_CONTACT, "distance2": 1}
LANE_CONTACT_STACK = places("LaneContactStack", _LANE_CONTACT_STACK)

# a moving grain in lanes, and how far it is from where the list was made, squared
_LANE_MOVE_STACK = {"rows": N_LANE, "moved2": 1}
LANE_MOVE_STACK = places("LaneMoveStack", _LANE_MOVE_STACK)

# a wall contact in lanes
_LANE_WALL_STACK = {"pressing": 1, "stiffness": 1}
LANE_WALL_STACK = places("LaneWallStack", _LANE_WALL_STACK)

LANE_STACKED = max(width(rows) for rows in (_LANE_CONTACT_STACK, _LANE_MOVE_STACK, _LANE_WALL_STACK))
