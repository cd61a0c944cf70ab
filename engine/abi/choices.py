"""The enumerations C and Python share: how a call ended, what happened, in which state a pair is, which array is meant."""

from __future__ import annotations

from engine.abi.records import Named


class Status(Named):
    """How a call into the runtime ended; from FAIL_NOT_FINITE on: why a run cannot go on."""

    OK = 0
    MORE = 1, "step budget used up: call again"
    ROWS_FULL = 2, "output buffer full: drain and call again"
    EVENTS_FULL = 3, "event buffer full: drain and call again"
    NEED_JACOBIAN = 4, "the method asks for the Jacobian unit: attach it and call again"
    DONE = 5
    NEED_REDUNDANT = 6, "friction depends on reactions that redundant loops leave open: use the redundant variant"
    STOPPED = 7, "the host, asked in the middle of the work, gave it up"
    EVENT = 8, "an event has been recorded, at which the host wants to stop"
    FAIL_NOT_FINITE = 10
    FAIL_STEP = 11, "step size underflow"
    FAIL_MULTIPLIERS = 12, "complement equations have no reachable root"
    FAIL_CLOSURE = 13, "loops cannot be closed"
    FAIL_MAX_STEPS = 14
    FAIL_GIMBAL = 15, "the turning axes of a loop lie in one plane, and it cannot turn on"
    FAIL_MODES = 16, "no set of sticking and slipping pairs satisfies the friction laws"
    FAIL_METHOD = 17, "there is no method of this number"
    FAIL_STALLED = 19, "trial step after trial step, and the time stands still"
    FAIL_TIME = 21, "the host, asked in the middle of the work, has no more time for it"
    INACCURATE = 18, "the end was reached, but the audit has found energy gained or lost far beyond the tolerance"
    CASE_FAILED = 20, "of a batch: a case ended early; the host may look at its block, then call again"


class EventKind(Named, prefix="TR_EV_"):
    """What happened at an event."""

    REVERSAL = 1, "sliding turned round: the contact normal jumps"
    STOP = 2, "a pair came to rest"
    SLIP = 3, "a pair at rest began to slide"
    SEPARATION = 4, "a normal force went through zero"
    TURN = 5, "a contact elsewhere turned at an event"
    STOP_ON = 6, "a stop was reached"
    STOP_OFF = 7, "a stop was left"
    SWITCH = 8
    IMPACT = 9, "a jammed pair stopped at once"
    FOLD = 10, "the friction that was followed has folded away, and another has taken its place"
    LATCH = 11, "a latch has fallen behind what it catches"
    UNLATCH = 12, "a latch has let go"


class PairState(Named):
    """The flag of a pair's mode. A law with a kink is proportional or saturated. A set-valued law sticks, slips, or (a ball
    only) turns inside its friction cone without sliding. Of a law whose only kink is at rest the flag stays 0; what changes is
    its direction."""

    STUCK = 0
    SLIPS = 1
    CONE = 2
    PROPORTIONAL = 0
    SATURATED = 1

    @classmethod
    def c_text(cls) -> str:
        """The C definition of the enumeration, in which a number may have two names."""
        lines = [f"  {cls.prefix}{name} = {m.value}," for name, m in cls.__members__.items()]
        return "\n".join([f"/* {' '.join((cls.__doc__ or '').split())} */", "enum {", *lines, "};\n"])


LINE = 1e134
"""Length beyond which the direction in a pair's mode is that of a pair that moves along a line (``line.c``)."""


class PairKind(Named, prefix="TR_KIND_"):
    """What a pair's law does at rest and at its kink."""

    SMOOTH = 0, "nothing: it is smooth"
    KINK = 1, "its branch changes at a sliding speed"
    SET = 2, "set-valued at rest"
    TURN = 3, "kink where a single rate changes sign"


class StopState(Named, prefix="TR_STOP_"):
    """The flag of a stop, which says whether it is engaged."""

    OPEN = 0
    PRESSED = 1


class Coordinate(Named, prefix="TR_COORDINATE_"):
    """What a coordinate or a rate measures."""

    ANGLE = 0
    LENGTH = 1
    QUATERNION = 2


class RowKind(Named, prefix="TR_CONSTRAINS_"):
    """What a constraint row holds."""

    TRAVEL = 0, "its multiplier is a force"
    TURNING = 1, "its multiplier is a torque"


class TableKind(Named, prefix="TR_TABLE_"):
    """How a table of signals is read."""

    LINEAR = 0, "straight lines between the knots"
    SPLINE = 1, "a cubic spline through the knots"
    INPUT = 2, "an external input (tr_input)"
    HERMITE = 3, "cubic pieces with given slopes at the knots"


class Post(Named, prefix="TR_POST_"):
    """What the runtime does with a column."""

    HOLD = 1, "keep its last value while its partner, a normal force, is zero"
    WRAP = 2, "continue an angle by whole turns"


class Wants(Named, prefix="TR_WANTS_"):
    """Bits for what a set of columns needs from the runtime besides what the kernel computes."""

    CONTRACTION = 1, "the contraction number in every row"
    AUDIT = 2, "how far the loops and the equations of friction are from their solution, and the verdict, in every row"
    SOLUTION = 4, "multipliers and accelerations in every row"


class Array(Named, prefix="TR_ARRAY_"):
    """Arrays of a block that hosts may look into (``tr_array``)."""

    PARAMETERS = 0, "np"
    STATE = 1, "q, v, friction states, integrals"
    SIGNALS = 2, "nx: what comes from outside the state"
    BREAKS = 3, "times at which a step has to end"
    TABLES = 4, "tables of signals"
    EVENTS = 5, "event records"
    MULTIPLIERS = 6, "active λ, then η"
    SLOPES = 7, "rows of K of the last step"
    MAPS = 8, "what stage 1 left for the multipliers"


class Why(Named, prefix="TR_WHY_"):
    """Why the equations of friction have no answer."""

    UNKNOWN = 0
    JAM = 1, "the pair's sliding stops at once, and from rest there is an answer"
    INCONSISTENT = 2, "not even from rest"
    UNDECIDED = 3, "so many pairs rest that an answer was neither found nor excluded"


class Verdict(Named, prefix="TR_VERDICT_"):
    """What the audit says of a run."""

    WITHIN = 0, "every figure is within what the tolerance allows"
    NOTE = 1, "some figure is not"
    INACCURATE = 2, "the energy is not, by far: the run does not count as done"


class Overrun(Named, prefix="TR_OVERRUN_"):
    """How a bounded step was made; from BY_IMPULSES on: what was left when its bounds were reached, or no other way
    was there."""

    NONE = 0, "as it should be"
    BY_IMPULSES = 1, "the rest by one step of impulses"
    RELAXED = 2, "the rest by one step of impulses whose friction is found by a few sweeps only"


class Law(Named, prefix="TR_LAW_"):
    """What the audit looks at besides the energy. Each figure is relative to the unit in its meaning."""

    CLOSURE = 0, "gap of a loop (of the length scale; of 1 rad)"
    CONE = 1, "friction of a pair beyond what its law allows (of what it allows)"
    DRIVES = 2, "power by which friction of a pair drives (of the largest power of friction)"
    CREEPS = 3, "speed of a pair that sticks (of the speed unit)"
    UNREST = 4, "acceleration of a pair that sticks (of the accelerations that cancel in it)"
    FRICTION = 5, "what the equations of friction leave open (of the largest friction)"


class Breaks(Named, prefix="TR_BREAKS_"):
    """Bits for the laws that an answer breaks."""

    LOOP = 1, "the equations of the loops"
    REST = 2, "a held pair moves"
    CONE = 4, "a held pair carries more than it can"
    LAW = 8, "friction is not what its law says"
    BRANCH = 16, "a pair is on the other branch of its law than its mode says"
    POWER = 32, "friction drives"
    START = 64, "a pair starts against its friction's sense"
    STOP = 128, "a stop presses with nothing in it, or does not with something"


class Ask(Named, prefix="TR_ASK_"):
    """What a case asks of the vectors in which cases make their steps together."""

    STEP = 0, "a trial step of an explicit method: stages, end and errors"
    DENSE = 1, "the extra stages of its dense output"
    END = 2, "a state back onto the manifold, and its slope"
    PROJECT = 3, "a state back onto the manifold"
    LOOK = 4, "multipliers of a state, and how pairs slide there"
    ALL = 5, "the same as END, with all that an evaluation leaves behind"
    ROWS = 6, "as many rows of one case as there are lanes"


class Strand(Named, prefix="TR_STRAND_"):
    """What a case of an ensemble is about."""

    GOES = 0, "it goes on when it is called"
    ASKS = 1, "it waits for what it has asked for"
    NEEDS = 2, "it waits for the Jacobian unit"
    OVER = 3, "there are no more cases for it"


class Ended(Named, prefix="TR_ENDED_"):
    """What became of a case of an ensemble."""

    NOT = 0, "it has not ended"
    WHOLE = 1, "it has come to its end"
    EARLY = 2, "it could not go on: it is to be made by itself, which tells why"


ENUMERATIONS: tuple[type[Named], ...] = (
    Status, EventKind, PairState, PairKind, StopState, Coordinate, RowKind, TableKind, Post, Wants, Array, Why, Verdict,
    Law, Breaks, Overrun, Ask, Strand, Ended,
)  # fmt: skip
