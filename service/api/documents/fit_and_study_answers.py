"""JSON documents with the results of fits and studies, returned by ``GET …/answer``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, Field

from trunnion.analysis.fits.fits_as_batch_cases import FitPlan, combine_rows
from trunnion.service.api.job_data.job_rows import job_contents, result_rows

if TYPE_CHECKING:
    from trunnion.service.api.server_state.server_components import Service

COLUMNS = ("case", "candidate", "outcome.advice", "answer")


class ProfileDocument(BaseModel):
    """The profile of a parameter: fixed values of the parameter, and for each value the increase of the sum of squares."""

    values: list[float]
    rises: list[float | None]


class IntervalDocument(BaseModel):
    """The confidence interval of a parameter. ``low`` and ``high`` follow from the profile of the parameter. ``local`` follows from
    the curvature of the sum of squares at the estimate."""

    low: float | None
    high: float | None
    low_end: Literal["found", "bound", "open"] = Field(
        description="bound or open: the data do not limit the parameter at this end."
    )
    high_end: Literal["found", "bound", "open"]
    local: list[float | None] = Field(min_length=2, max_length=2, description="null: the data do not determine it.")
    profile: ProfileDocument


class CombinationDocument(BaseModel):
    """A combination of inseparable parameters. The data determine the value of the combination."""

    exponents: list[float]
    deviation: float | None


class InseparableDocument(BaseModel):
    """Parameters that the data cannot separate."""

    names: list[str]
    determined: list[CombinationDocument]
    product: bool
    exact: bool
    confirmed: bool
    told: str = Field(description="Explanation and advice.")


class CriteriaDocument(BaseModel):
    """Criteria for the comparison of friction laws; null: infinite."""

    likelihood: float | None
    numbers: int
    values: int
    aicc: float | None
    bic: float | None


class FitDocument(BaseModel):
    """A fit, as ``trunnion.fit`` returns it."""

    values: dict[str, float | None]
    units: dict[str, str]
    deviation: dict[str, float | None] = Field(description="Local standard deviations; null: the data do not determine it.")
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
    """A compared friction law. ``why``: the reason why ``fit`` is null."""

    name: str
    weight: float | None
    why: str
    worse_by_bic: float | None
    worse_by_aicc: float | None
    fit: FitDocument | None


class ComparedDocument(BaseModel):
    """The compared friction laws. The law with the best BIC comes first."""

    candidates: list[CandidateDocument]
    notes: list[str]


class ExperimentDocument(BaseModel):
    """A possible experiment. ``gain``: expected information gain in bits; null if the experiment is impossible. ``why``: the reason
    why it is impossible."""

    name: str
    gain: float | None
    deviation: dict[str, float | None]
    why: str


class FitAnswer(BaseModel):
    """The result of a fit. If friction laws are compared, ``fit`` is the fit of the best law."""

    kind: Literal["fit"]
    fit: FitDocument | None
    why: str = Field(description="The reason if there is no fit.")
    compared: ComparedDocument | None
    experiments: list[ExperimentDocument]


class NumberDocument(BaseModel):
    """A varied number of the scene."""

    path: str
    unit: str
    value: float


class Step(BaseModel):
    """A case of an optimisation whose result was better than all earlier results."""

    case: int
    value: float | None = Field(description="Best result so far; null if the case violates constraints or has no value.")


class ConstraintDocument(BaseModel):
    """A constraint of an optimisation: bounds of the result ``of``, in SI units. null: no bound."""

    of: str
    low: float | None
    high: float | None


class BestAnswer(BaseModel):
    """Result of an optimisation."""

    kind: Literal["optimise"]
    goal: Literal["minimise", "maximise", "reach"]
    of: str
    target: float | None
    within: list[ConstraintDocument]
    why: str = Field(description="Why the study ended, or that it continues.")
    settled: bool
    feasible: bool = Field(description="Whether the best case satisfies all constraints.")
    constraints_missed: float | None = Field(
        description="Total violation of the constraints, each relative to its scale; null if the best case has no value."
    )
    off_target: float | None = Field(description="Result of the best case minus the target; null without a target or a value.")
    case: int
    numbers: list[NumberDocument]
    results: dict[str, float | None]
    cases: int
    failed: int = Field(description="Cases without a value.")
    path: list[Step]


class Boundary(BaseModel):
    """A small interval of the varied numbers in which the outcome changes or the result jumps."""

    low: list[float]
    high: list[float]
    outcomes: list[str]
    narrow: bool = Field(description="Whether the interval is as narrow as requested.")
    change: float | None = Field(description="Jump of the result; null if the outcome changes here.")


class BoundariesAnswer(BaseModel):
    """Result of a refinement."""

    kind: Literal["refine"]
    of: str
    why: str = Field(description="Why the study ended, or that it continues.")
    paths: list[str]
    units: list[str]
    boundaries: list[Boundary]
    more: int = Field(description="Number of boundaries that are not listed.")
    cases: int


class StudyAnswer(BaseModel):
    """Result of a study or a fit."""

    complete: bool = Field(description="Whether the answer is final.")
    ended: bool = Field(description="Whether the job has ended.")
    answer: BestAnswer | BoundariesAnswer | FitAnswer | None = Field(description="null before the first round or fit.")


def fit_answer(s: Service, job: str, plan: FitPlan, cases: int) -> dict[str, Any] | None:
    """The combined result of the finished fits of a job; None if no fit has finished."""
    import pyarrow as pa

    shown = pa.schema([job_contents(s, job).schema.field(n) for n in COLUMNS])
    kept = [row for table in result_rows(s, job, shown, 0, cases) for row in table.to_pylist()]
    return combine_rows(plan, kept) if kept else None
