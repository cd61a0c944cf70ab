"""/v1/sensitivities: derivatives of outputs by parameters along one run."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field

from service.answered import SensitivityRequest
from service.api.bodies import asks, told
from service.api.jobs import Here, Submitter
from service.api.problems import documented
from service.api.waiting import Call, answered
from service.executor.differentiate import run_sensitivity

router = APIRouter(prefix="/v1", tags=["sensitivities"])
QUEUE_SECONDS = 60
"""Time a request may wait for its turn, beside its own budget."""
EXAMPLES: Any = {
    "friction": {
        "summary": "How a swing depends on friction and on the ball's radius",
        "value": {
            "scene": "spherical_pendulum",
            "parameters": ["joints.ball.friction.mu", "joints.ball.friction.radius"],
            "outputs": ["ball.qd[2]", "ball.contact[1].normal_force"],
            "until": 0.5,
            "every": 0.1,
        },
    },
    "start": {
        "summary": "By a start value, with another friction",
        "value": {
            "scene": "crank_slider",
            "overrides": {"joints.slider_pin.friction.mu": 0.2},
            "parameters": ["joints.slider_pin.friction.mu"],
            "outputs": ["slider_pin.q*"],
            "until": 0.1,
            "budget": 60,
        },
    },
}  # fmt: skip
ANSWER: dict[str, Any] = {
    "time": [0.0, 0.5],
    "outputs": ["ball.qd[2]"],
    "units": ["rad/s"],
    "parameters": ["joints.ball.friction.mu"],
    "parameter_units": ["1"],
    "derivative_units": [["rad/s"]],
    "values": [[0.0], [5.86]],
    "derivatives": [[[0.0]], [[-0.407]]],
    "notes": [],
    "events": [],
}


class Moved(BaseModel):
    """An event whose time depends on the parameters."""

    time: float
    joint: str
    shift: list[float | None] = Field(description="d(time)/d(parameter), s per unit of each parameter.")


class SensitivityDocument(BaseModel):
    """Outputs and their derivatives at the sample times; null where there is no number."""

    time: list[float] = Field(description="s")
    outputs: list[str]
    units: list[str] = Field(description="Of each output.")
    parameters: list[str]
    parameter_units: list[str]
    derivative_units: list[list[str]] = Field(description="Output by parameter.")
    values: list[list[float | None]] = Field(description="Sample by output.")
    derivatives: list[list[list[float | None]]] = Field(description="Sample by output by parameter.")
    notes: list[str]
    events: list[Moved]

    model_config = {"json_schema_extra": {"examples": [ANSWER]}}


@router.post(
    "/sensitivities",
    response_model=SensitivityDocument,
    responses=documented(413),
    openapi_extra=asks(SensitivityRequest, EXAMPLES),
)
async def sensitivities(caller: Submitter, s: Here, request: Request) -> Response:
    """d(output)/d(parameter) along a run and across its events, exactly along its steps (no differences of runs). The answer comes
    with this request; closing the connection ends the work."""
    document, seconds = await told(s, request, caller, "plain_sensitivity")
    half = max(1, s.cluster.counted // 2)  # the other workers are for jobs, and for looking at them
    call = Call(run_sensitivity, (document, seconds), s.derivatives, half)
    answer = await answered(s, request, seconds + QUEUE_SECONDS, call)
    return Response(answer, media_type="application/json")
