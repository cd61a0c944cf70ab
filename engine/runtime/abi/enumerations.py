"""Enumerations that C and Python share."""

from __future__ import annotations

from trunnion.runtime.abi.record_definition import Named


class Status(Named):
    """Result of a call into the runtime. FAIL_NOT_FINITE and all later members state why a run ends or is rejected."""

    OK = 0
    MORE = 1, "step budget used up: call again"
    ROWS_FULL = 2, "output buffer full: empty it and call again"
    EVENTS_FULL = 3, "event buffer full: empty it and call again"
    NEED_JACOBIAN = 4, "the method needs the kernel's code of the Jacobian: attach it and call again"
    DONE = 5
    NEED_REDUNDANT = 6, "friction depends on reactions that redundant constraints leave open: use the kernel's redundant variant"
    CANCELLED = 7, "the host cancelled the work"
    EVENT = 8, "an event was logged, and the host must handle it"
    NEED_INERTIA = 9, "the host must examine whether all motions of the assembled case move inertia"
    WAITS = 23, "the case waits for the SIMD lanes"
    FAIL_NOT_FINITE = 10
    FAIL_STEP = 11, "step size underflow"
    FAIL_MULTIPLIERS = 12, "complement equations have no reachable root"
    FAIL_CLOSURE = 13, "loops cannot be closed"
    FAIL_MAX_STEPS = 14
    FAIL_GIMBAL = 15, "the rotation axes of a loop lie in one plane, and the loop cannot move on"
    FAIL_MODES = 16, "no set of sticking and slipping pairs satisfies the friction laws"
    FAIL_METHOD = 17, "no method has this number"
    FAIL_STALLED = 19, "many trial steps without progress in time"
    FAIL_TIME = 21, "the time limit of the host is reached"
    FAIL_PENETRATION = 22, "the parts of a joint that only pushes penetrate each other"
    INACCURATE = 18, "the end was reached, but the audit found energy gained or lost far beyond the tolerance"
    CASE_FAILED = 20, "a case of a batch ended early: the host may read its block and must call again"


class EventKind(Named, prefix="TR_EV_"):
    """Kind of an event. The number 8 is reserved."""

    REVERSAL = 1, "sliding changed its direction, and the contact jumped"
    STICK = 2, "a sliding pair came to rest and sticks"
    SLIP = 3, "a sticking pair began to slide"
    SEPARATION = 4, "a normal force passed through zero, and the contact crossed its clearance"
    CONTACT_JUMP = 5, "a contact jumped because another pair, a load or a drive changed at this instant"
    END_STOP_ENGAGED = 6, "an end stop, or the hook of a latch, began to press"
    END_STOP_RELEASED = 7, "an end stop, or the hook of a latch, ceased to press"
    IMPACT = 9, "a jammed pair stopped at once by a tangential impact"
    FOLD = 10, "the present solution of the friction equations ceased to exist, and another solution replaced it"
    LATCH = 11, "the hook of a latch engaged behind the tooth that had passed"
    UNLATCH = 12, "the hook of a latch lifted"
    CONTACT_OPENED = 13, "a joint that only pushes ceased to press, and its parts separate"
    CONTACT_CLOSED = 14, "a gap became 0, with an impact; with restitution, the contact opens again at once"
    CONTACT_RESTS = 15, "impacts in ever faster succession reached their limit, and the contact stays closed"


class PairState(Named):
    """Flag of the mode of a sliding pair. Under a law with a kink, the pair is in the proportional or in the saturated zone. Under
    a set-valued law, the pair sticks or slips; a ball may also spin inside its friction cone without sliding. Under a law whose
    only kink is at rest, the flag stays 0, and only the direction of friction changes."""

    STUCK = 0
    SLIPS = 1
    CONE = 2
    PROPORTIONAL = 0
    SATURATED = 1


LINE = 1e134
"""Norm of a mode's direction above which the pair moves along a line (``modes/frozen_sliding_directions.c``)."""


class PairKind(Named, prefix="TR_KIND_"):
    """Behaviour of a pair's law at rest and at its kink."""

    SMOOTH = 0, "smooth"
    KINK = 1, "two branches that meet at a sliding speed above zero"
    SET = 2, "set-valued at rest"
    TURN = 3, "kink where a single rate changes sign"


class StopState(Named, prefix="TR_STOP_"):
    """Flag of an end stop, a latch's hook or a contact."""

    OPEN = 0
    PRESSED = 1


class Coordinate(Named, prefix="TR_COORDINATE_"):
    """Quantity of a coordinate or a rate."""

    ANGLE = 0
    LENGTH = 1
    QUATERNION = 2


class RowKind(Named, prefix="TR_CONSTRAINS_"):
    """Quantity that a constraint row fixes."""

    TRAVEL = 0, "a translation: the row's multiplier is a force"
    TURNING = 1, "a rotation: the row's multiplier is a torque"


class TableKind(Named, prefix="TR_TABLE_"):
    """Kind of a signal's table: how values between the knots are found."""

    LINEAR = 0, "straight lines between the knots"
    SPLINE = 1, "a cubic spline through the knots"
    INPUT = 2, "an external input (tr_input)"
    HERMITE = 3, "cubic pieces with given slopes at the knots"


class Post(Named, prefix="TR_POST_"):
    """Post-processing of a column."""

    HOLD = 1, "keep the column's last value while its partner column, a normal force, is round-off"
    WRAP = 2, "unwrap an angle: add multiples of 2π so that it is continuous"
    TOUCH = 3, "1 if the column's value, a normal force, is above round-off, otherwise 0"


class Wants(Named, prefix="TR_WANTS_"):
    """Bits that state what a set of columns needs from the runtime, besides the kernel."""

    CONTRACTION = 1, "the contraction number in every row"
    AUDIT = 2, "residuals of loops and friction equations, and the verdict, in every row"
    SOLUTION = 4, "multipliers and accelerations in every row"


class Array(Named, prefix="TR_ARRAY_"):
    """Arrays of a block that hosts may access (``tr_array``)."""

    PARAMETERS = 0, "np"
    STATE = 1, "q, v, friction states, integrals"
    SIGNALS = 2, "nx: signals, stop flags, modes"
    BREAKS = 3, "times at which a step must end"
    TABLES = 4, "tables of signals"
    EVENTS = 5, "event records"
    MULTIPLIERS = 6, "active λ, then η"
    SLOPES = 7, "slopes of the stages of the last step (rows of K)"
    MAPS = 8, "affine maps of the multipliers, by stage 1"


class Why(Named, prefix="TR_WHY_"):
    """Reason why the equations of friction have no solution."""

    UNKNOWN = 0
    JAM = 1, "a solution exists after a sudden stop of the pair"
    INCONSISTENT = 2, "no solution exists even at rest"
    UNDECIDED = 3, "too many pairs at rest: not all combinations of modes were tried, and no solution was found"


class Verdict(Named, prefix="TR_VERDICT_"):
    """Verdict of the audit on a run."""

    WITHIN = 0, "all figures are within the tolerance"
    NOTE = 1, "a figure exceeds the tolerance"
    INACCURATE = 2, "the energy error exceeds the tolerance by far: the run counts as failed"


class AuditLaw(Named, prefix="TR_LAW_"):
    """Figures of the audit besides energy, each relative to the unit in brackets."""

    CLOSURE = 0, "gap of a loop (length scale; 1 rad)"
    CONE = 1, "friction of a stuck pair beyond its capacity (that capacity)"
    DRIVES = 2, "power that friction adds to the motion of a pair (largest power of friction)"
    CREEPS = 3, "speed of a stuck pair (speed unit)"
    UNREST = 4, "acceleration of a stuck pair (sum of the absolute values of its terms)"
    FRICTION = 5, "residual of the equations of friction (largest friction)"


class Breaks(Named, prefix="TR_BREAKS_"):
    """Bits of the laws that a solution violates."""

    LOOP = 1, "the equations of the loops"
    REST = 2, "a held pair moves"
    CONE = 4, "a held pair carries more than its capacity"
    LAW = 8, "friction differs from its law"
    BRANCH = 16, "a pair's mode names the wrong side of a kink or cone"
    POWER = 32, "friction drives"
    START = 64, "friction drives a pair that starts to slide"
    STOP = 128, "an end stop is engaged without contact, or open with contact"


class Overrun(Named, prefix="TR_OVERRUN_"):
    """Outcome of a bounded step. After a reached limit or a failure, the members from BY_IMPULSES on state how the rest of the step
    was computed."""

    NONE = 0, "completed within its limits"
    BY_IMPULSES = 1, "completed by one impulse step"
    RELAXED = 2, "completed by one impulse step, with friction approximated in a few sweeps"


class Ask(Named, prefix="TR_ASK_"):
    """Kind of a request to the SIMD lanes."""

    STEP = 0, "trial step of an explicit method: stages, end and errors"
    DENSE = 1, "extra stages of the dense output of a step"
    END = 2, "projection of a step's end, and the evaluation there"
    ROWS = 3, "output rows of one case, one row in each lane"


class Lane(Named, prefix="TR_LANE_"):
    """State of a case's request to the SIMD lanes."""

    FREE = 0, "no request"
    ASKS = 1, "the case waits for its request"
    SERVED = 2, "the lanes have answered the request, with or without results"


class Strand(Named, prefix="TR_STRAND_"):
    """State of a strand of an ensemble."""

    GOES = 0, "ready to continue"
    ASKS = 1, "waits for its request"
    NEEDS = 2, "waits until the host attaches the Jacobian unit"
    OVER = 3, "no cases left"


class Ended(Named, prefix="TR_ENDED_"):
    """Outcome of a case of an ensemble."""

    NOT = 0, "not ended"
    WHOLE = 1, "complete"
    EARLY = 2, "the case could not continue: the host runs it alone to find the reason"


ENUMERATIONS: tuple[type[Named], ...] = tuple(Named.__subclasses__())
