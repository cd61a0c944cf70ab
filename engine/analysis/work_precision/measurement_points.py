"""A measured point of a work-precision diagram, and a CSV table of all points."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import asdict, fields
from pathlib import Path

from trunnion.basics.atomic_files import writing
from trunnion.basics.lazy_data_classes import dataclass

ENGINE = "trunnion"
"""Name of the engine in the list of programs."""


@dataclass(frozen=True)
class FrictionVariant:
    """A friction law and its regularisation speed v_eps, m/s. law: "" means no friction; v_eps: 0 means that the law has no such
    speed."""

    law: str = ""
    v_eps: float = 0.0

    def __str__(self) -> str:
        return f"{self.law}, v_eps {self.v_eps:g}" if self.v_eps else self.law


@dataclass(frozen=True)
class Measurement:
    """Cost and error of one setting. Errors are relative (``ErrorMeasure``), NaN for a failed run or a missing reference.

    Attributes:
        rtol: relative tolerance; 0 with fixed steps.
        step: fixed step, s; 0 with error control.
        law: friction law of the run.
        v_eps: regularisation speed of the friction law, m/s.
        error: distance from the reference solution of this law.
        model_error: distance from the reference solution of the exact law.
        minimum: least stepping time of the repeats, s.
        median: median stepping time of the repeats, s.
        repeats: number of timed runs.
        outcome: "done", or the time and reason of the failure.
        leaves_out: parts of the scene that the program does not model.
        predicted: error estimated by a second, tighter run (theory, "Global error"); NaN without one.
    """

    program: str
    method: str
    rtol: float
    step: float
    law: str
    v_eps: float
    error: float
    model_error: float
    minimum: float
    median: float
    repeats: int
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    events: int = 0
    outcome: str = "done"
    leaves_out: str = ""
    predicted: float = math.nan

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.outcome == "done"

    @property
    def variant(self) -> FrictionVariant:
        """The friction law of the point with its v_eps."""
        return FrictionVariant(self.law, self.v_eps)

    @property
    def fixed(self) -> bool:
        """Whether the step was fixed."""
        return self.step > 0.0

    @property
    def setting(self) -> str:
        """The tolerance or step as text."""
        return f"step {self.step:.3g} s" if self.fixed else f"rtol {self.rtol:.0e}"


UNITS = {"step": "s", "v_eps": "m/s", "minimum": "s", "median": "s"}


def write_table(points: Iterable[Measurement], path: Path, notes: Iterable[str] = ()) -> Path:
    """Write a CSV file and return its path. Notes come first as comment lines. Column names include the units."""
    names = [f.name for f in fields(Measurement)]
    with writing(path, (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        for note in notes:
            file.write(f"# {note}\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow([f"{n} [{UNITS[n]}]" if n in UNITS else n for n in names])
        for p in points:
            out.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in asdict(p).values()])
    return path


def pareto_front(points: Iterable[Measurement]) -> list[Measurement]:
    """The points that no other point beats in both error and least time, by decreasing error."""
    out: list[Measurement] = []
    for p in sorted((p for p in points if p.ok and p.error >= 0.0), key=lambda p: (p.minimum, p.error)):
        if not out or p.error < out[-1].error:
            out.append(p)
    return out
