"""What the audit says of a run: whether it obeyed the laws it claims to obey (METHOD, "Audit"), each figure with time and joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from engine.abi import Law, Status, Verdict
from engine.simulation.outcome import Outcome, from_status

WORDS = {v: v.name.lower() for v in Verdict}
"""The verdicts as users read them."""
SAID = {
    Law.CLOSURE: "a loop stays open (of its length)",
    Law.CONE: "friction is beyond its law (of what that allows)",
    Law.DRIVES: "friction drives (of its largest power)",
    Law.CREEPS: "what sticks moves (of the scale of speeds)",
    Law.UNREST: "what sticks accelerates (of what cancels there)",
    Law.FRICTION: "the equations of friction are left open (of the largest friction)",
}
"""What is wrong where a law is broken; in brackets: what the number behind it is a part of."""


@dataclass(frozen=True)
class Figure:
    """The worst figure of a law along a run. size, in the unit that ``engine.abi.Law`` states (1 is as wrong as can be); time, s,
    None where it is not known; joint: its name, "" where it belongs to none."""

    size: float = 0.0
    time: float | None = None
    joint: str = ""


@dataclass(frozen=True)
class Audit:
    """The verdict on a run, and what it rests on.

    verdict: "within" (every figure is within what the tolerance allows), "note" (some are not: ``notes``), "inaccurate" (the energy
    is off by more than a thousand times the tolerance, or by a tenth, of the energy turned over: such a run does not end as done);
    "none" of a run that did not start. tolerance: what it is measured by. energy: largest energy that is unaccounted for, J
    (positive: gained), at energy_time, s; most of it came just before jump_time, s, after an event of jump_joint ("": none). None:
    it was not looked at. turned_over, J: what it is measured by; share: of that. laws: the worst figure of every other law, by
    its name in ``engine.abi.Law``."""

    verdict: str = "none"
    tolerance: float = 0.0
    energy: float | None = None
    energy_time: float | None = None
    jump_time: float | None = None
    jump_joint: str = ""
    turned_over: float = 0.0
    share: float = 0.0
    laws: dict[str, Figure] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """The audit as plain data."""
        return asdict(self) | {"notes": list(self.notes)}

    def __str__(self) -> str:
        balance = f"energy within {self.share:.1g} of {self.turned_over:.3g} J"
        if self.energy is None:
            balance = "energy not looked at (ask for the columns energy.*)"
        return f"{self.verdict}: {balance}, tolerance {self.tolerance:.1g}"


def audit_of(record: np.void, joints: Sequence[str]) -> Audit:
    """The audit of a run from the runtime's record (``tr_judgement``). joints: names of the joints with friction."""
    known, verdict = bool(record["judged"]), Verdict(int(record["verdict"]))
    laws = {law: _figure(record["law"][law], joints) for law in Law}
    audit = Audit(
        verdict=WORDS[verdict],
        tolerance=float(record["tolerance"]),
        energy=float(record["lost"]) if known else None,
        energy_time=_time(record["lost_time"]),
        jump_time=_time(record["jump_time"]),
        jump_joint=_joint(record["jump_joint"], joints),
        turned_over=float(record["turned"]) if known else 0.0,
        share=float(record["share"]) if known else 0.0,
        laws={law.name.lower(): f for law, f in laws.items()},
    )
    if verdict is Verdict.WITHIN:
        return audit
    said = [_energy_said(audit)] if known and record["share"] > record["noted_energy"] else []
    said += [_law_said(law, f) for law, f in laws.items() if f.size > record["noted"]]
    return replace(audit, notes=tuple(said))


def _time(t: float) -> float | None:
    return float(t) if t >= 0.0 else None


def _joint(number: float, joints: Sequence[str]) -> str:
    return joints[int(number) - 1] if number > 0.0 else ""


def _figure(worst: np.void, joints: Sequence[str]) -> Figure:
    return Figure(float(worst["size"]), _time(worst["time"]), _joint(worst["joint"], joints))


def _law_said(law: Law, f: Figure) -> str:
    where = f", joint {f.joint}" if f.joint else ""
    return f"audit at t = {f.time or 0.0:.6g} s{where}: {SAID[law]}: {f.size:.1g}"


def _energy_said(a: Audit) -> str:
    word = "gained" if (a.energy or 0.0) > 0.0 else "lost"
    where = f", joint {a.jump_joint}" if a.jump_joint else ""
    most = f"{abs(a.energy or 0.0):.3g} J of {a.turned_over:.3g} J turned over {word}"
    return f"audit at t = {a.jump_time or 0.0:.6g} s{where}: {most} by the end, most of it before then: {a.share:.1g}"


def judged(outcome: Outcome, audit: Audit) -> Outcome:
    """How the run ended once the audit has spoken: one that reached its end is ``inaccurate`` where the audit says so."""
    if not outcome.ok or audit.verdict != WORDS[Verdict.INACCURATE]:
        return outcome
    time = outcome.time if audit.jump_time is None else audit.jump_time
    plain = from_status(Status.INACCURATE, time, audit.jump_joint)
    return replace(plain, numbers={"energy": audit.energy or 0.0, "turned_over": audit.turned_over, "share": audit.share})
