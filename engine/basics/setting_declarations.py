"""The settings of a run: name, unit, valid values, help text, and the commands, functions and requests that offer each setting.

This table is the source of options of the command line, checks of Python functions and fields of REST requests. A new setting needs
an entry in this table, and code that uses the setting. """

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.basics.number_declarations import ANY, NOT_NEGATIVE, POSITIVE, Bound

RTOL = Bound(1e-14, 0.1, advice="1e-6 is a good start")
"""Allowed relative tolerances. Below 1e-14, the error estimate of a step is only rounding error. Above 0.1, results are
meaningless."""
STUDIES = ("trunnion sweep", "trunnion optimise", "trunnion refine")
SWEEPS = (*STUDIES, "trunnion.sweep", "POST /v1/jobs")
DERIVATIVES = ("trunnion sensitivity", "trunnion.sensitivity", "POST /v1/sensitivities")
WEAR = "trunnion wear"
KNOCKS = "trunnion knocks"
KINEMATICS = "trunnion kinematics"
SERVED = ("POST /v1/jobs", "trunnion jobs submit")
RUNS = ("trunnion simulate", "trunnion.simulate", *SWEEPS)
"""Commands, Python functions and requests that offer settings of runs."""


@dataclass(frozen=True)
class Setting:
    """A setting of a run.

    name           in Python and REST, and with two dashes on the command line.
    unit           SI unit ("1": dimensionless); empty if the value is a word.
    text           description, a sentence; ``{methods}``, ``{laws}`` and ``{kernels}`` stand for the names in the registries.
    offered        commands, functions and requests that offer the setting.
    default        the default value, in words; ``own_defaults`` holds other defaults, by command, function or request.
    bound          allowed values; ``own_bounds`` holds other bounds, by command, function or request.
    words          "methods", "laws" or "kernels" if the value is a name from that registry.
    metavar        placeholder of the value in a command's help.
    several        commands that accept several values."""

    name: str
    unit: str
    text: str
    offered: tuple[str, ...]
    default: str
    bound: Bound = ANY
    words: str = ""
    metavar: str = ""
    several: tuple[str, ...] = ()
    own_defaults: Mapping[str, str] = field(default_factory=dict)
    own_bounds: Mapping[str, Bound] = field(default_factory=dict)

    def bound_at(self, who: str) -> Bound:
        """Allowed values at a command, function or request."""
        return self.own_bounds.get(who, self.bound)

    def told(self, who: str) -> str:
        """The help text of the setting at a command, function or request, with the default. The text still contains its
        placeholders."""
        many = " Repeatable." if who in self.several else ""
        return f"{self.text}{many} Default: {self.default_at(who)}."

    def default_at(self, who: str) -> str:
        """The default at a command, function or request, in words."""
        return self.own_defaults.get(who, self.default)


_SPACING = Bound(0.0, open=True, advice="give a positive spacing, such as 10 ms")
SETTINGS = (
    Setting(
        "until", "s", "End of the run, s: 10, 500 ms, 2 min.",
        (*RUNS, *DERIVATIVES, WEAR, KNOCKS, KINEMATICS, "trunnion chart", "trunnion advise", "trunnion jobs submit"), "the scene's",
        Bound(POSITIVE.least, open=True, advice="give a positive end time, such as 2.5, 10 ms or 1 min"), metavar="T",
    ),
    Setting(
        "every", "s", "Spacing of the rows, s. 0 gives a row at each step of the solver.",
        (*RUNS, *DERIVATIVES, WEAR, KNOCKS, KINEMATICS, "trunnion jobs submit"), "the scene's, or a thousandth of the run",
        Bound(NOT_NEGATIVE.least, advice="give a positive spacing, or 0 for every step"), metavar="DT",
        own_defaults=dict.fromkeys(DERIVATIVES, "a hundredth of the run"), own_bounds=dict.fromkeys(DERIVATIVES, _SPACING),
    ),
    Setting(
        "rtol", "1", "Relative tolerance of positions and velocities.",
        (*RUNS, *DERIVATIVES, WEAR, KNOCKS, KINEMATICS, "trunnion chart"),
        "the scene's", RTOL, metavar="R", several=("trunnion chart",),
        own_defaults=dict.fromkeys(DERIVATIVES, "1e-9") | {"trunnion chart": "1e-2 … 1e-12"},
    ),
    Setting(
        "step", "s", "Fixed step of the solver, s, in place of error control.", ("trunnion simulate", "trunnion.simulate"),
        "error control", Bound(NOT_NEGATIVE.least, advice="a positive step, or 0 for error control"), metavar="H",
    ),
    Setting(
        "method", "", "Integration method: {methods}.", (*RUNS, WEAR, KNOCKS, "trunnion chart"), "the scene's", words="methods",
        metavar="M", several=("trunnion chart",), own_defaults={"trunnion chart": "all"},
    ),
    Setting(
        "kernel", "",
        "How the equations are evaluated: {kernels}. With parts, nothing is compiled, so runs start at once. With compiled, "
        "small scenes run faster. auto means compiled for 1000 or more runs of a small scene, otherwise parts.",
        RUNS, "auto", words="kernels", metavar="K",
    ),
    Setting(
        "cpu_limit", "s", "Largest processor time of a case, s; a longer case ends with the outcome out_of_time.",
        (*SWEEPS, "trunnion jobs submit"), "no limit",
        Bound(0.0, open=True, advice="a positive time, such as 60 or 5 min"), metavar="S",
        own_defaults=dict.fromkeys(SERVED, "what the server allows"),
    ),
    Setting(
        "max_steps", "1", "Largest number of steps of a run; a longer run ends with the outcome max_steps.",
        (*SWEEPS, "trunnion.simulate", "trunnion jobs submit"), "no limit",
        Bound(1.0, 2e9, advice="a number from 1 to 2e9"), metavar="N",
        own_defaults=dict.fromkeys(SERVED, "what the server allows"),
    ),
    Setting(
        "law", "", "Friction law of all joints: {laws}.",
        ("trunnion simulate", *STUDIES, "trunnion sensitivity", WEAR, KNOCKS, "trunnion chart"), "each joint's own",
        words="laws", metavar="L", several=("trunnion chart",), own_defaults={"trunnion chart": "all"},
    ),
)  # fmt: skip
"""All settings of runs."""


def offered(who: str) -> tuple[Setting, ...]:
    """The settings that a command, function or request offers."""
    return tuple(s for s in SETTINGS if who in s.offered)
