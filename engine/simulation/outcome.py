"""How a run ended: a named outcome with the time, the place and what to try. Nothing ends in a bare exception."""

from __future__ import annotations

from dataclasses import dataclass, field

from engine.abi import Status
from engine.friction import DEFAULT, twin_of
from engine.integrators import AUTO, METHODS

DONE = "done"
APART = "apart"
"""How a run ends where two parts that touch along their overlap no longer do."""
TOO_MANY_ROWS = "too_many_rows"
TOO_MANY_EVENTS = "too_many_events"
"""How a run with a row at every step of the solver ends when these have become too many: nobody knows their number before."""
NAMES: dict[int, str] = {
    Status.FAIL_NOT_FINITE: "not_finite",
    Status.FAIL_STEP: "step_underflow",
    Status.FAIL_STALLED: "stalled",
    Status.FAIL_MULTIPLIERS: "no_solution",
    Status.FAIL_CLOSURE: "open_loop",
    Status.FAIL_MAX_STEPS: "max_steps",
    Status.FAIL_GIMBAL: "gimbal",
    Status.FAIL_MODES: "inconsistent",
    Status.FAIL_METHOD: "unknown_method",
    Status.FAIL_TIME: "out_of_time",
    Status.INACCURATE: "inaccurate",
}
ADVICE = {
    "not_finite": "a freedom without inertia, or numbers far out of range: check masses, inertias and start values of the joint; "
    f"with a fixed step, take a smaller step or method {AUTO.stiff.name}",
    "step_underflow": f"the motion becomes singular or far stiffer than the tolerance allows here: try method {AUTO.stiff.name}, a "
    "looser rtol, or look at the mechanism's configuration at this time",
    "stalled": "thousands of steps were tried and the time stands still: try another rtol or method "
    f"({', '.join(METHODS[1:])}), and look at the mechanism at this time",
    "no_solution": "the complement equations have no solution: with this friction the joint named jams (or its law has no answer, "
    "Painlevé); lengthen the guide (half_length), lower mu or radius, or bring the load closer",
    "jammed": "friction grows without bound, so that the joint's sliding stops at once (an impact without a collision): "
    "lengthen the guide (half_length), lower mu or radius, bring the load closer, or go on with simulation.jams: impact",
    "inconsistent": "no combination of sticking and slipping satisfies Coulomb's law here (Painlevé, or a jam): lower mu or "
    f"radius, lengthen the guide, or continue with law {twin_of(DEFAULT)}",
    "undecided": "so many joints rest here that not all choices of sticking and slipping can be tried; none was found that "
    "satisfies Coulomb's law, and none is excluded: lower mu or radius, leave friction out where it does not matter, or "
    f"continue with law {twin_of(DEFAULT)}",
    "open_loop": "the loops cannot be kept closed here: the mechanism reaches a configuration where it cannot move on; check the "
    "lengths along the loop and how far its drives go (with a fixed step, try a smaller one)",
    "gimbal": "all free turning axes of the loop lie in one plane here (a gimbal, or a spherical linkage at the end of its reach), "
    "so that it cannot turn as its drives ask: keep its angles away from there, or add a turning freedom across that plane",
    "max_steps": f"the step budget is used up: raise max_steps (of a sweep: steps), or try method {AUTO.stiff.name}",
    "out_of_time": "the case has used up its patience; reductions are over its rows up to then: give it more, look at the "
    f"mechanism at this time for joints that stop and slip without end, or try a looser rtol or method {AUTO.stiff.name}",
    "unknown_method": f"there is no such method: use one of {', '.join(METHODS)}",
    TOO_MANY_ROWS: "the rows of all the solver's steps take the memory that a result may have; rows so far are kept: give every "
    "a spacing, end earlier, or ask for fewer columns with outputs",
    TOO_MANY_EVENTS: "the events of the run take the memory that a result may have; rows and events so far are kept: end earlier, "
    "or ask what makes a joint stop and slip so often (its last events name it)",
    "inaccurate": "the run reached its end, but gained or lost energy far beyond its tolerance; its results are kept "
    f"and not to be relied on: try a tighter rtol, another method ({', '.join(METHODS[1:])}), or no fixed step",
    APART: "a part of finite length has slid off the other, so that nothing holds them: lengthen one (inboard_length, "
    "outboard_length), or give the joint stops",
    "stopped": "stopped on request; results up to then are kept",
}


@dataclass(frozen=True)
class Outcome:
    """How a run ended. name: "done" or what went wrong; time when it happened, s; joint it is about ("" when it is about the
    whole); advice: what to try; numbers that say how far it went wrong, by name."""

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
    """The outcome that belongs to a ``Status`` of the runtime."""
    name = NAMES.get(status, f"status_{status}")
    return Outcome(name, time, joint, ADVICE.get(name, "please report this"))
