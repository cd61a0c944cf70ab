"""The audit of a run: violations of the laws of its model, with the time and joint of each figure (theory, "Audit")."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import asdict, field, replace
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.runtime.abi import AuditLaw, Status, Verdict
from trunnion.runtime.abi.run_records import JUDGEMENT
from trunnion.simulation.results.outcome import Outcome, from_status

WORDS = {int(v): v.name.lower() for v in Verdict}
"""The word for each verdict."""
WITHIN, INACCURATE = WORDS[Verdict.WITHIN], WORDS[Verdict.INACCURATE]
LAW_NAMES = tuple(law.name.lower() for law in AuditLaw)
WORST_FIGURES = JUDGEMENT.at("law")
"""Index of the first ``tr_worst`` in a judgement."""
NUMBERS = struct.Struct(f"{JUDGEMENT.numbers}d")
VIOLATIONS = {
    AuditLaw.CLOSURE: "a loop is open (relative to its length)",
    AuditLaw.CONE: "friction exceeds the limit of its law (relative to this limit)",
    AuditLaw.DRIVES: "friction adds energy to the motion (power, relative to the largest power of friction)",
    AuditLaw.CREEPS: "a sticking pair moves (relative to the speed scale of the scene)",
    AuditLaw.UNREST: "a sticking pair accelerates (relative to the accelerations that should cancel)",
    AuditLaw.FRICTION: "the equations of friction have a residual (relative to the largest friction)",
}
"""Description of the violation of each law. The brackets state to what the figure is relative."""


@dataclass(frozen=True)
class Figure:
    """The largest violation of a law in a run.

    Attributes:
        size: violation, divided by the reference that ``trunnion.runtime.abi.AuditLaw`` gives for the law.
        time: time of the violation, s; None if unknown.
        joint: name of the joint; "" if the violation belongs to no joint.
    """

    size: float = 0.0
    time: float | None = None
    joint: str = ""


NO_VIOLATION = Figure()


@dataclass(frozen=True)
class Audit:
    """The verdict on a run, with its figures.

    Attributes:
        verdict: "within" (every figure is within the tolerance), "note" (some figures are not, see ``notes``), "inaccurate" or
            "none" (the run did not start). "inaccurate" means that the energy error, relative to ``turned_over``, exceeds 1000
            times the tolerance or a tenth. The outcome is then not ``done``.
        tolerance: the tolerance to which the figures are compared.
        energy: largest energy error, J, positive for gained energy; None without an energy balance.
        energy_time: time of the largest energy error, s.
        jump_time: time of the largest increase of the energy error, s.
        jump_joint: joint of the event before ``jump_time``; "" if there is no such event.
        turned_over: energy turned over, J.
        share: energy error relative to ``turned_over``.
        laws: largest violation of every other law, by the law's name in ``trunnion.runtime.abi.AuditLaw``.
        notes: a note for every figure beyond the tolerance.
    """

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
            balance = "no energy balance (add energy.* to outputs)"
        return f"{self.verdict}: {balance}, tolerance {self.tolerance:.1g}"


def audit_of(record: bytes, joints: Sequence[str]) -> Audit:
    """The audit of a run from the runtime's record (``tr_judgement``). joints: names of the joints with friction."""
    numbers = NUMBERS.unpack(record)
    said = dict(zip(JUDGEMENT.names, numbers, strict=False))
    known, word = said["judged"] != 0.0, WORDS[int(said["verdict"])]
    figures = _figures(numbers[WORST_FIGURES:], joints)
    audit = Audit(
        verdict=word,
        tolerance=said["tolerance"],
        energy=said["lost"] if known else None,
        energy_time=_time(said["lost_time"]),
        jump_time=_time(said["jump_time"]),
        jump_joint=_joint(said["jump_joint"], joints),
        turned_over=said["turned"] if known else 0.0,
        share=said["share"] if known else 0.0,
        laws=dict(zip(LAW_NAMES, figures, strict=True)),
    )
    if word == WITHIN:
        return audit
    notes = [_energy_note(audit)] if known and said["share"] > said["noted_energy"] else []
    notes += [_law_note(law, f) for law, f in zip(AuditLaw, figures, strict=True) if f.size > said["noted"]]
    return replace(audit, notes=tuple(notes))


def _time(t: float) -> float | None:
    return t if t >= 0.0 else None


def _joint(number: float, joints: Sequence[str]) -> str:
    return joints[int(number) - 1] if number > 0.0 else ""


def _figures(worst: Sequence[float], joints: Sequence[str]) -> list[Figure]:
    """A figure for each ``tr_worst``. worst: all fields of the records."""
    records = zip(worst[::3], worst[1::3], worst[2::3], strict=True)
    return [Figure(size, _time(time), _joint(joint, joints)) if size else NO_VIOLATION for size, time, joint in records]


def _law_note(law: AuditLaw, f: Figure) -> str:
    where = f", joint {f.joint}" if f.joint else ""
    return f"audit at t = {f.time or 0.0:.6g} s{where}: {VIOLATIONS[law]}: {f.size:.1g}"


def _energy_note(a: Audit) -> str:
    word = "gained" if (a.energy or 0.0) > 0.0 else "lost"
    where = f", joint {a.jump_joint}" if a.jump_joint else ""
    most = f"{word} {abs(a.energy or 0.0):.3g} J of the {a.turned_over:.3g} J turned over"
    return (
        f"audit at t = {a.jump_time or 0.0:.6g} s{where}: {most} in the run, mostly before this time (relative error {a.share:.1g})"
    )


def judged(outcome: Outcome, audit: Audit) -> Outcome:
    """The outcome after the audit: ``done`` becomes ``inaccurate`` if this is the audit's verdict."""
    if not outcome.ok or audit.verdict != INACCURATE:
        return outcome
    time = outcome.time if audit.jump_time is None else audit.jump_time
    plain = from_status(Status.INACCURATE, time, audit.jump_joint)
    return replace(plain, numbers={"energy": audit.energy or 0.0, "turned_over": audit.turned_over, "share": audit.share})
