"""One measured point of a chart, and the table of all of them."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from engine.basics.files import writing

OURS = "trunnion"


@dataclass(frozen=True)
class Variant:
    """A friction law with its numbers: name ("" without friction), v_eps in m/s (0: the law has none)."""

    law: str = ""
    v_eps: float = 0.0

    def __str__(self) -> str:
        return f"{self.law}, v_eps {self.v_eps:g}" if self.v_eps else self.law


@dataclass(frozen=True)
class Point:
    """What one setting costs and how well it does.

    program, method; rtol (0: fixed step), step in s (0: error control); law and v_eps of the friction solved; error: distance from
    the reference solution of the same law; model_error: distance from the reference of the exact law (both relative, see
    ``measures``; NaN when the run failed or there is no such reference); minimum and median stepping time of the repeats, s;
    steps, rejected, evaluations, events; outcome: "done", or where and why it failed; leaves_out: what of the scene the program
    does not model; predicted: the error that a second, tighter run
    states, measured alike (METHOD, "Global error"), NaN where none was made.
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
    def variant(self) -> Variant:
        """The friction law of the point with its v_eps."""
        return Variant(self.law, self.v_eps)

    @property
    def fixed(self) -> bool:
        """Whether it was stepped with a fixed step."""
        return self.step > 0.0

    @property
    def setting(self) -> str:
        """The tolerance or step of the point in words."""
        return f"step {self.step:.3g} s" if self.fixed else f"rtol {self.rtol:.0e}"


UNITS = {"step": "s", "v_eps": "m/s", "minimum": "s", "median": "s"}


def write_table(points: Iterable[Point], path: Path, notes: Iterable[str] = ()) -> Path:
    """CSV with the notes as comment lines in front; units stand in the column names."""
    names = [f.name for f in fields(Point)]
    with writing(path, (".csv",)) as work, work.open("w", newline="", encoding="utf-8") as file:
        for note in notes:
            file.write(f"# {note}\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow([f"{n} [{UNITS[n]}]" if n in UNITS else n for n in names])
        for p in points:
            out.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in asdict(p).values()])
    return path


def front(points: Iterable[Point], model: bool = False) -> list[Point]:
    """The points that no other beats in both error and least time, by falling error."""
    alive = [p for p in points if p.ok and (p.model_error if model else p.error) >= 0.0]
    alive.sort(key=lambda p: (p.minimum, p.model_error if model else p.error))
    out: list[Point] = []
    for p in alive:
        e = p.model_error if model else p.error
        if not out or e < (out[-1].model_error if model else out[-1].error):
            out.append(p)
    return out
