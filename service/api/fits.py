"""What a fit has found, as documents."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, Field

from engine.fits.cases import FitPlan, answer_of
from service.api.reading import known, rows

if TYPE_CHECKING:
    from service.api.service import Service

COLUMNS = ("case", "candidate", "outcome.advice", "answer")


class ProfileDocument(BaseModel):
    """The profile of a parameter: values, and by how much the sum of squares rises when it is held there."""

    values: list[float]
    rises: list[float | None]


class IntervalDocument(BaseModel):
    """Where a parameter lies, by its profile, and by the curvature at the estimate."""

    low: float | None
    high: float | None
    low_end: Literal["found", "bound", "open"] = Field(description="bound, open: the data allow all values up to there.")
    high_end: Literal["found", "bound", "open"]
    local: list[float | None] = Field(min_length=2, max_length=2, description="null where the data leave it open.")
    profile: ProfileDocument


class CombinationDocument(BaseModel):
    """What is determined of parameters that cannot be told apart."""

    exponents: list[float]
    deviation: float | None


class InseparableDocument(BaseModel):
    """Parameters that the data cannot tell apart."""

    names: list[str]
    determined: list[CombinationDocument]
    product: bool
    exact: bool
    confirmed: bool
    told: str = Field(description="What is to be known of it, and what to do.")


class CriteriaDocument(BaseModel):
    """By which laws are compared; null: infinite."""

    likelihood: float | None
    numbers: int
    values: int
    aicc: float | None
    bic: float | None


class FitDocument(BaseModel):
    """A fit, as ``engine.fit`` gives it."""

    values: dict[str, float | None]
    units: dict[str, str]
    deviation: dict[str, float | None] = Field(description="Local standard deviations; null: the data leave it open.")
    correlation: list[list[float | None]]
    misfit: float | None
    rounds: int
    converged: bool
    level: float
    noise: dict[str, dict[str, float | None]] = Field(description="Standard deviations by run and column, given or estimated.")
    intervals: dict[str, IntervalDocument]
    inseparable: list[InseparableDocument]
    criteria: CriteriaDocument | None
    notes: list[str]


class CandidateDocument(BaseModel):
    """A law that was compared; without a fit, why there is none."""

    name: str
    weight: float | None
    why: str
    worse_by_bic: float | None
    worse_by_aicc: float | None
    fit: FitDocument | None


class ComparedDocument(BaseModel):
    """The laws that were compared, the best by BIC first."""

    candidates: list[CandidateDocument]
    notes: list[str]


class ExperimentDocument(BaseModel):
    """An experiment and what it would tell, in bits; null: it cannot be made, why says why."""

    name: str
    gain: float | None
    deviation: dict[str, float | None]
    why: str


class FitAnswer(BaseModel):
    """What a fit has found: of laws the best one's."""

    kind: Literal["fit"]
    fit: FitDocument | None
    why: str = Field(description="Why there is none.")
    compared: ComparedDocument | None
    experiments: list[ExperimentDocument]


def fit_answer(s: Service, job: str, plan: FitPlan, cases: int) -> dict[str, Any] | None:
    """What the fits of a job that are there come to; None where there is none yet."""
    import pyarrow as pa

    shown = pa.schema([known(s, job).schema.field(n) for n in COLUMNS])
    kept = [row for table in rows(s, job, shown, 0, cases) for row in table.to_pylist()]
    return answer_of(plan, kept) if kept else None
