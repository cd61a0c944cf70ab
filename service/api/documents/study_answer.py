"""JSON documents of studies that ``GET …/answer`` returns."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from trunnion.service.api.documents.fit_answer import FitAnswer


class NumberDocument(BaseModel):
    """A varied number of the scene."""

    path: str
    unit: str
    value: float


class Step(BaseModel):
    """A case that was better than all earlier cases."""

    case: int
    value: float | None = Field(description="Best result so far; null if the case violates constraints or has no value.")


class BestAnswer(BaseModel):
    """Result of an optimisation."""

    kind: Literal["optimise"]
    goal: Literal["minimise", "maximise", "reach"]
    of: str
    target: float | None
    why: str = Field(description="Why the study ended, or that it continues.")
    settled: bool
    feasible: bool = Field(description="Whether the best case satisfies all constraints.")
    missed: float | None = Field(description="Total violation of the constraints; null if the best case has no value.")
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
