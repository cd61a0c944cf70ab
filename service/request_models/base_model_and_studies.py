"""Field types of requests, and request models of samples and studies."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from trunnion.analysis.studies.box_refinement import OUTCOME
from trunnion.analysis.studies.evolution_strategy import GOALS
from trunnion.analysis.studies.request import LEAST, MOST, MOST_REFINED, TOLERANCES, StudyRequest
from trunnion.analysis.studies.study_rounds import REVISION
from trunnion.basics.control_characters import PLAIN
from trunnion.basics.renamed_words import SETTINGS, current

Path = Annotated[str, StringConstraints(min_length=1, max_length=500)]
PlainText = Annotated[str, StringConstraints(max_length=200, pattern=PLAIN)]
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


class RequestModel(BaseModel):
    """Base class of all request models. An unknown field is a problem."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _sound(cls, data: Any) -> Any:
        """Replace deprecated names of fields in plain data. Invalid Unicode and too deep nesting raise errors."""
        todo = [(data, 0)]
        while todo:
            value, depth = todo.pop()
            if depth > DEEPEST:
                raise ValueError(f"the value has more than {DEEPEST} levels of nesting")
            if isinstance(value, str) and not _unicode(value):
                raise ValueError("the text holds half of a surrogate pair, which is invalid Unicode")
            if isinstance(value, dict):
                todo += [(k, depth + 1) for k in value]
                value = list(value.values())
            if isinstance(value, list):
                todo += [(v, depth + 1) for v in value]
        return current_fields(data, cls.model_fields) if isinstance(data, dict) else data


def current_fields(data: dict[str, Any], known: Container[str]) -> dict[str, Any]:
    """The fields of a request with current names. Deprecated names are reported. A request that contains both names of a field is
    refused later."""
    renamed = [k for k in data if k not in known and SETTINGS.get(k) in known and SETTINGS[k] not in data]
    return {current("field", SETTINGS, k) if k in renamed else k: v for k, v in data.items()}


class Sample(RequestModel):
    """A sample of cases, reproducible by its seed."""

    ranges: dict[Path, tuple[Number, Number] | Text] = Field(
        max_length=100,
        description='By path: lowest and highest value, or "normal(mean, deviation)", "lognormal(mean, deviation)", '
        '"triangular(low, mode, high)".',
    )
    count: int = Field(ge=1, le=100_000_000, description="Number of cases; with the method saltelli, number of points.")
    seed: int = Field(0, ge=0, le=2**63 - 1)
    method: Annotated[str, StringConstraints(pattern="^(latin|random|sobol|saltelli)$")] = Field(
        "latin", description="saltelli is for Sobol indices: each point has 2 n + 2 cases, for n sampled numbers."
    )


Bounds = dict[Path, tuple[Number, Number]]
Revision = Annotated[
    int, Field(ge=1, le=REVISION, description="Revision of the search. A stored request keeps the revision that chose its cases.")
]


class Optimise(RequestModel):
    """A search for optimal parameters within bounds. Exactly one of ``minimise``, ``maximise`` and ``reach`` is required. The same
    seed gives the same result."""

    bounds: Bounds = Field(min_length=1, max_length=50, description="Lowest and highest value, by path.")
    minimise: PlainText | None = Field(None, description="Reduction to minimise.")
    maximise: PlainText | None = Field(None, description="Reduction to maximise.")
    reach: tuple[PlainText, Number] | None = Field(None, description="Reduction and its target value.")
    within: dict[PlainText, tuple[Number | None, Number | None]] = Field(
        default_factory=dict, max_length=50, description="Lower and upper limit, by reduction; null: no limit."
    )
    cases: int = Field(600, ge=LEAST, le=MOST, description="Largest number of cases.")
    seed: int = Field(0, ge=0, le=2**62)
    tolerance: float = Field(
        1e-3, ge=TOLERANCES[0], le=TOLERANCES[1], description="Tolerance of the optimal numbers, relative to their ranges."
    )
    revision: Revision = REVISION


class Refine(RequestModel):
    """A refinement: the cases are placed where the outcome changes, or where a result jumps or has a kink."""

    bounds: Bounds = Field(min_length=1, max_length=MOST_REFINED, description="Lowest and highest value, by path.")
    of: PlainText = Field(
        OUTCOME, description="A reduction whose jumps and kinks are also located; outcome: only changes of the outcome are located."
    )
    cases: int = Field(200, ge=LEAST, le=MOST, description="Largest number of cases.")
    tolerance: float = Field(
        1e-3, ge=TOLERANCES[0], le=TOLERANCES[1], description="Width of the interval of a located change, relative to the ranges."
    )
    revision: Revision = REVISION


def study_request(asked: Mapping[str, Any]) -> StudyRequest | None:
    """The study that a request describes; None for a request without a study."""
    if (best := asked.get("optimise")) is not None:
        goals = {name: best[name] for name in GOALS if best.get(name) is not None}
        rest = {name: best[name] for name in ("cases", "seed", "tolerance")}
        return StudyRequest("optimise", best["bounds"], goals, best["within"], revision=best.get("revision", 1), **rest)
    if (where := asked.get("refine")) is not None:
        rest = {name: where[name] for name in ("of", "cases", "tolerance")}
        return StudyRequest("refine", where["bounds"], revision=where.get("revision", 1), **rest)
    return None
