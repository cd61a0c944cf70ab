"""The settings of a run, declared once: what each is called, its unit, the values it may have, what it is, and who offers it.

The options of the command line, the checks of the Python functions and the fields of the service's requests follow from this table;
a new setting is one entry here and the code that does what it says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from engine.basics.numbers import ANY, NOT_NEGATIVE, POSITIVE, Bound

RTOL = Bound(1e-14, 0.1, advice="1e-6 is a good start")
"""Relative tolerances: below, steps drown in round-off; above, they are no approximation."""
SWEEPS = ("trunnion sweep", "engine.sweep", "POST /v1/jobs")
DERIVATIVES = ("trunnion sensitivity", "engine.sensitivity", "POST /v1/sensitivities")
WEAR = "trunnion wear"
KNOCKS = "trunnion knocks"
KINEMATICS = "trunnion kinematics"
SERVED = ("POST /v1/jobs", "trunnion jobs submit")
RUNS = ("trunnion simulate", "engine.simulate", *SWEEPS)
"""Who offers settings: commands, Python functions, requests."""


@dataclass(frozen=True)
class Setting:
    """A setting of a run.

    name         its name in Python and REST, and with two dashes at the command line.
    unit         its SI unit ("1" for none); empty for a word.
    text         what it is, in a sentence; ``{methods}`` and ``{laws}`` stand for what the registries hold.
    offered      who offers it.
    left_out     what holds where it is not given; ``own_left_out``: at those who have it otherwise.
    bound        the values it may have; ``own_bounds``: at those who allow others.
    words        "methods", "laws" or "kernels" where its value is the name of one.
    metavar      what stands for its value in the help of a command.
    several      who takes several values of it.
    """

    name: str
    unit: str
    text: str
    offered: tuple[str, ...]
    left_out: str
    bound: Bound = ANY
    words: str = ""
    metavar: str = ""
    several: tuple[str, ...] = ()
    own_left_out: Mapping[str, str] = field(default_factory=dict)
    own_bounds: Mapping[str, Bound] = field(default_factory=dict)

    def bound_at(self, who: str) -> Bound:
        """The values it may have at one of those who offer it."""
        return self.own_bounds.get(who, self.bound)

    def told(self, who: str) -> str:
        """What it is and what holds where it is not given, in sentences; the placeholders are left as they are."""
        many = " Repeatable." if who in self.several else ""
        return f"{self.text}{many} Left out: {self.own_left_out.get(who, self.left_out)}."


_SPACING = Bound(0.0, open=True, advice="give a positive spacing, such as 10 ms")
SETTINGS = (
    Setting(
        "until", "s", "End of the run, s: 10, 500 ms, 2 min.",
        (*RUNS, *DERIVATIVES, WEAR, KNOCKS, KINEMATICS, "trunnion chart", "trunnion advise", "trunnion jobs submit"), "the scene's",
        Bound(POSITIVE.least, open=True, advice="give a positive end time, such as 2.5, 10 ms or 1 min"), metavar="T",
    ),
    Setting(
        "every", "s", "Spacing of the rows, s; 0: a row at each of the solver's own steps.",
        (*RUNS, *DERIVATIVES, WEAR, KNOCKS, KINEMATICS, "trunnion jobs submit"), "the scene's, or a thousandth of the run",
        Bound(NOT_NEGATIVE.least, advice="give a positive spacing, or 0 for every step"), metavar="DT",
        own_left_out=dict.fromkeys(DERIVATIVES, "a hundredth of the run"), own_bounds=dict.fromkeys(DERIVATIVES, _SPACING),
    ),
    Setting(
        "rtol", "1", "Relative tolerance of positions and velocities.",
        (*RUNS, *DERIVATIVES, WEAR, KNOCKS, KINEMATICS, "trunnion chart"),
        "the scene's", RTOL, metavar="R", several=("trunnion chart",),
        own_left_out=dict.fromkeys(DERIVATIVES, "1e-9") | {"trunnion chart": "1e-2 … 1e-12"},
    ),
    Setting(
        "step", "s", "Fixed step of the solver, s, in place of error control.", ("trunnion simulate", "engine.simulate"),
        "steps by error control", Bound(NOT_NEGATIVE.least, advice="a positive step, or 0 for error control"), metavar="H",
    ),
    Setting(
        "method", "", "Integration method: {methods}.", (*RUNS, WEAR, KNOCKS, "trunnion chart"), "the scene's", words="methods",
        metavar="M", several=("trunnion chart",), own_left_out={"trunnion chart": "all"},
    ),
    Setting(
        "kernel", "", "What evaluates the scene: {kernels}; of parts an unseen structure starts at once, for nothing is "
        "compiled; compiled small ones step faster. auto: parts, but for 1000 runs or more of a small structure.",
        RUNS, "auto", words="kernels", metavar="K",
    ),
    Setting(
        "patience", "s", "Processor seconds that a case may take; then its outcome is out_of_time and the others go on.",
        (*SWEEPS, "trunnion jobs submit"), "as long as it takes",
        Bound(0.0, open=True, advice="a positive time, such as 60 or 5 min"), metavar="S",
        own_left_out=dict.fromkeys(SERVED, "what the server allows"),
    ),
    Setting(
        "steps", "1", "Steps of the solver that a case may take; then its outcome is max_steps and the others go on.",
        (*SWEEPS, "trunnion jobs submit"), "any number", Bound(1.0, 2e9, advice="a number from 1 to 2e9"), metavar="N",
        own_left_out=dict.fromkeys(SERVED, "what the server allows"),
    ),
    Setting(
        "law", "", "Friction law of all joints: {laws}.",
        ("trunnion simulate", "trunnion sweep", "trunnion sensitivity", WEAR, KNOCKS, "trunnion chart"), "each joint's own",
        words="laws", metavar="L", several=("trunnion chart",), own_left_out={"trunnion chart": "all"},
    ),
)  # fmt: skip
"""All settings of runs."""


def offered(who: str) -> tuple[Setting, ...]:
    """The settings that a command, function or request offers."""
    return tuple(s for s in SETTINGS if who in s.offered)
