"""What studies have found, as documents."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from service.api.fits import FitAnswer


class NumberDocument(BaseModel):
    """A number of the scene."""

    path: str
    unit: str
    value: float


class Step(BaseModel):
    """A case that was the best so far."""

    case: int
    value: float | None = Field(description="Its result; null of a case that misses constraints or has no value.")


class BestAnswer(BaseModel):
    """The best numbers."""

    kind: Literal["optimise"]
    goal: Literal["minimise", "maximise", "reach"]
    of: str
    target: float | None
    why: str = Field(description="Why it has ended, or that it goes on.")
    settled: bool
    feasible: bool = Field(description="Whether the best case keeps all constraints.")
    missed: float | None = Field(description="How far constraints are missed; null where the best case has no value.")
    case: int
    numbers: list[NumberDocument]
    results: dict[str, float | None]
    cases: int
    failed: int = Field(description="Cases without a value.")
    path: list[Step]


class Boundary(BaseModel):
    """A box in which outcomes change or the result jumps."""

    low: list[float]
    high: list[float]
    outcomes: list[str]
    narrow: bool = Field(description="Whether it is as narrow as was asked.")
    change: float | None = Field(description="By how much the result jumps; null where outcomes change.")


class BoundariesAnswer(BaseModel):
    """Where outcomes change and the result jumps."""

    kind: Literal["refine"]
    of: str
    why: str = Field(description="Why it has ended, or that it goes on.")
    paths: list[str]
    units: list[str]
    boundaries: list[Boundary]
    more: int = Field(description="Boundaries that are not told.")
    cases: int


class StudyAnswer(BaseModel):
    """What a study or a fit has found."""

    complete: bool = Field(description="Whether it asks for no more cases, or all its fits are there.")
    ended: bool = Field(description="Whether the job has ended, of itself or not.")
    answer: BestAnswer | BoundariesAnswer | FitAnswer | None = Field(description="null before its first round, or fit.")
