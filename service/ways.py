"""What requests are made of: words with limits, and the ways of saying which cases a job has."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

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
