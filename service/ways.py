"""What requests are made of: words with limits, and the ways of saying which cases a job has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from engine.studies.asked import LEAST, MOST, MOST_REFINED, TOLERANCES, Wanted
from engine.studies.optimum import GOALS
from engine.studies.refined import OUTCOME

Path = Annotated[str, StringConstraints(min_length=1, max_length=500)]
Plain = Annotated[str, StringConstraints(max_length=200, pattern=r"^[^\x00-\x1f]*$")]
Text = Annotated[str, StringConstraints(max_length=100)]
Number = float | Text
Tag = Annotated[str, StringConstraints(min_length=1, max_length=50, pattern=r"^[\w.:/+@-]+$")]
DEEPEST = 60


def _unicode(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


class Asked(BaseModel):
    """Base of all requests: unknown fields are mistakes."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _sound(cls, data: Any) -> Any:
        """Refuse text that is not valid Unicode, and data nested too deeply."""
        todo = [(data, 0)]
        while todo:
            value, depth = todo.pop()
            if depth > DEEPEST:
                raise ValueError(f"it is nested more than {DEEPEST} deep")
            if isinstance(value, str) and not _unicode(value):
                raise ValueError("it holds half of a surrogate pair, which is no text")
            if isinstance(value, dict):
                todo += [(k, depth + 1) for k in value]
                value = list(value.values())
            if isinstance(value, list):
                todo += [(v, depth + 1) for v in value]
        return data


class Sample(Asked):
    """A sample of cases, the same for the same seed."""

    ranges: dict[Path, tuple[Number, Number] | Text] = Field(
        max_length=100,
        description='By path: low and high end, or "normal(mean, deviation)", "lognormal(mean, deviation)", '
        '"triangular(low, mode, high)".',
    )
    count: int = Field(ge=1, le=100_000_000, description="How many cases; with the method saltelli, how many points.")
    seed: int = Field(0, ge=0, le=2**63 - 1)
    method: Annotated[str, StringConstraints(pattern="^(latin|random|sobol|saltelli)$")] = Field(
        "latin", description="saltelli: 2 × numbers + 2 cases for each point, of which Sobol indices are made."
    )


Bounds = dict[Path, tuple[Number, Number]]


class Optimise(Asked):
    """The best numbers within bounds; exactly one of ``minimise``, ``maximise`` and ``reach``. The same seed gives the same
    cases."""

    bounds: Bounds = Field(min_length=1, max_length=50, description="Low and high end by path.")
    minimise: Plain | None = Field(None, description="A reduction that shall be small.")
    maximise: Plain | None = Field(None, description="A reduction that shall be large.")
    reach: tuple[Plain, Number] | None = Field(None, description="A reduction, and the value it shall have.")
    within: dict[Plain, tuple[Number | None, Number | None]] = Field(
        default_factory=dict, max_length=50, description="Reductions and the ends they shall keep, null for none."
    )
    cases: int = Field(600, ge=LEAST, le=MOST, description="Most cases.")
    seed: int = Field(0, ge=0, le=2**62)
    tolerance: float = Field(1e-3, ge=TOLERANCES[0], le=TOLERANCES[1], description="How near to the best numbers, of their ranges.")


class Refine(Asked):
    """Where outcomes change and a result jumps or bends: cases are added there."""

    bounds: Bounds = Field(min_length=1, max_length=MOST_REFINED, description="Low and high end by path.")
    of: Plain = Field(OUTCOME, description="A reduction, looked at beside the outcomes; outcome: those alone.")
    cases: int = Field(200, ge=LEAST, le=MOST, description="Most cases.")
    tolerance: float = Field(1e-3, ge=TOLERANCES[0], le=TOLERANCES[1], description="Width of the place of a change, of the ranges.")


def wanted_of(asked: Mapping[str, Any]) -> Wanted | None:
    """The study that a request asks for; None when it asks for none."""
    if (best := asked.get("optimise")) is not None:
        goals = {name: best[name] for name in GOALS if best.get(name) is not None}
        rest = {name: best[name] for name in ("cases", "seed", "tolerance")}
        return Wanted("optimise", best["bounds"], goals, best["within"], **rest)
    if (where := asked.get("refine")) is not None:
        return Wanted("refine", where["bounds"], of=where["of"], cases=where["cases"], tolerance=where["tolerance"])
    return None
