"""Outcomes of runs, with time, joint and remedy."""

from __future__ import annotations

from dataclasses import field

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.friction import DEFAULT, twin_of
from trunnion.runtime.abi import Status
from trunnion.runtime.integrators import AUTO, METHODS

DONE, CANCELLED = "done", "cancelled"
DEAD_CENTRE = "dead_centre"
"""The outcome of a loop without friction whose equations have no solution in the current position."""
OVERLAP_LOST = "overlap_lost"
"""The outcome if two parts of a joint have slid off each other."""
PENETRATION = "penetration"
"""The outcome if the parts of a joint that only pushes are inside each other."""
NO_INERTIA = "no_inertia"
"""The outcome if a motion of the mechanism moves no inertia."""
TOO_MANY_ROWS, TOO_MANY_EVENTS = "too_many_rows", "too_many_events"
"""Outcomes of runs whose rows or events filled the memory allowed for a result."""
NAMES: dict[int, str] = {
    Status.FAIL_NOT_FINITE: "not_finite",
    Status.FAIL_STEP: "step_underflow",
    Status.FAIL_STALLED: "no_progress",
    Status.FAIL_MULTIPLIERS: "no_solution",
    Status.FAIL_CLOSURE: "open_loop",
    Status.FAIL_MAX_STEPS: "max_steps",
    Status.FAIL_GIMBAL: "gimbal_lock",
    Status.FAIL_MODES: "inconsistent",
    Status.FAIL_METHOD: "unknown_method",
    Status.FAIL_PENETRATION: PENETRATION,
    Status.FAIL_TIME: "out_of_time",
    Status.INACCURATE: "inaccurate",
}
ADVICE = {
    NO_INERTIA: "the mechanism has a motion that moves no mass and no inertia, so no force determines its acceleration. Give the "
    "moved bodies mass and inertia, or remove the freedom. In place of a massless body between two balls, use type: rod",
    "not_finite": "a freedom has no inertia, a formula of time has no value, or numbers are far out of range. Check masses, "
    f"inertias and start values of the joint. With a fixed step, use a smaller step or method {AUTO.stiff.name}",
    "step_underflow": "the steps became too small: the motion is singular here, or too stiff for the tolerance. "
    f"Try method {AUTO.stiff.name} or a looser rtol, or look at the mechanism at this time",
    "no_progress": "thousands of trial steps did not advance the time. Try another rtol or method "
    f"({', '.join(METHODS[1:])}), or a smaller step if it is fixed, and look at the mechanism at this time",
    "no_solution": "the equations of friction have no solution: the joint jams, or its friction law has no solution here "
    "(Painlevé's paradox). Lengthen the guide (half_length), lower mu or radius, or move the load closer to the joint",
    "jammed": "friction grows without bound and stops the sliding suddenly (an impact without a collision). "
    "Lengthen the guide (half_length), lower mu or radius, or move the load closer to the joint. "
    "To continue the run beyond the jam, set simulation.jams: impact",
    "inconsistent": "no combination of sticking and slipping satisfies Coulomb's law here (Painlevé's paradox, or a jam). "
    f"Lower mu or radius, lengthen the guide, or use the friction law {twin_of(DEFAULT)}",
    "undecided": "too many pairs are at rest here to try all combinations of sticking and slipping. No combination that was tried "
    "satisfies Coulomb's law. Lower mu or radius, remove friction that hardly affects the motion, or "
    f"use the friction law {twin_of(DEFAULT)}",
    "open_loop": "the loops cannot be kept closed: the mechanism reached a position from which it cannot move further. Check the "
    "lengths along the loop and the range of its drives. With a fixed step, try a smaller step",
    "gimbal_lock": "all free axes of rotation of the loop lie in one plane here, so the loop cannot turn as its drives demand. "
    "(The loop contains a gimbal, or is a spherical linkage at the end of its reach.) Avoid this position, or add a rotation axis "
    "outside that plane",
    PENETRATION: "the parts of the contact are inside each other. If this is at the start, move the start values apart, or "
    "leave out starts: open, so that the contact begins closed. If this is at the mouth of a slot, the pin strikes the edge of the "
    "mouth: give the slot more play, or turn the parts so that the pin meets the slot",
    DEAD_CENTRE: "the loop is at a dead centre. Its joints cannot follow the acceleration that the drives demand, or could follow "
    "this acceleration by two different motions. Start beside this position, drive another joint, or let the drives rest here",
    "max_steps": f"the run reached its largest number of steps. Raise max_steps, or try method {AUTO.stiff.name}",
    "out_of_time": "the case exceeded its time budget; its reductions cover the rows computed so far. Raise cpu_limit, or try a "
    f"looser rtol or method {AUTO.stiff.name}. Look at the mechanism at this time for joints that alternate between sticking and "
    "slipping without end",
    "unknown_method": f"unknown method: use one of {', '.join(METHODS)}",
    TOO_MANY_ROWS: "the rows at all steps of the solver fill the memory allowed for a result; the rows so far are kept. Set "
    "every to the time between rows, end the run earlier, or compute fewer columns (outputs)",
    TOO_MANY_EVENTS: "the events of the run fill the memory allowed for a result; the rows and events so far are kept. End "
    "the run earlier, or find out why a joint sticks and slips so often (the last events name the joint)",
    "inaccurate": "the run reached its end, but gained or lost energy far beyond its tolerance; its results are kept "
    f"but unreliable. Try a tighter rtol, another method ({', '.join(METHODS[1:])}), or error control in place of a fixed step",
    OVERLAP_LOST: "one part of the joint slid off the other. Lengthen one of the parts (inboard_length, outboard_length), or give "
    "the joint end stops",
    CANCELLED: "the user or the host cancelled the run; the results up to this time are kept",
}


@dataclass(frozen=True)
class Outcome:
    """The end of a run.

    Attributes:
        name: "done" or the name of a failure.
        time: time of the end, s.
        joint: name of the joint that causes the failure; "" for the whole mechanism.
        advice: cause and remedy.
        numbers: figures of the failure, by name.
    """

    name: str
    time: float
    joint: str = ""
    advice: str = ""
    numbers: dict[str, float] = field(default_factory=dict)

    @classmethod
    def named(cls, name: str, time: float, joint: str, numbers: dict[str, float] | None = None) -> Outcome:
        """An outcome with its standard advice."""
        return cls(name, time, joint, ADVICE[name], numbers or {})

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.name == DONE

    def __str__(self) -> str:
        if self.ok:
            return f"done at t = {self.time:g} s"
        where = f" in joint {self.joint}" if self.joint else ""
        return f"{self.name}{where} at t = {self.time:.6g} s: {self.advice}"


def from_status(status: int, time: float, joint: str) -> Outcome:
    """The outcome of a ``Status`` of the runtime."""
    name = NAMES.get(status, f"status_{status}")
    return Outcome(name, time, joint, ADVICE.get(name, "please report this"))
