"""/v1/sensitivities: derivatives of outputs with respect to parameters along one run."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field

from trunnion.service.api.documents.problem_documents import error_responses
from trunnion.service.api.transport.api_keys_and_rates import ServerState, Submitter
from trunnion.service.api.transport.cluster_calls import call_cluster
from trunnion.service.api.transport.request_bodies import body_schema, check_body
from trunnion.service.executor.chunk_and_case_runs import run_sensitivity
from trunnion.service.request_models.sensitivity_and_fmu_requests import SensitivityRequest
from trunnion.service.request_workers.worker_tasks import plan_sensitivity

router = APIRouter(prefix="/v1", tags=["sensitivities"])
QUEUE_SECONDS = 60
"""Longest time that a request waits in the queue, s, in addition to the request's budget."""
EXAMPLES: Any = {
    "friction": {
        "summary": "Derivatives of a swing with respect to the friction coefficient and the radius of the ball",
        "value": {
            "scene": "spherical_pendulum",
            "parameters": ["joints.ball.friction.mu", "joints.ball.friction.radius"],
            "outputs": ["ball.qd[2]", "ball.contact[1].normal_force"],
            "until": 0.5,
            "every": 0.1,
        },
    },
    "start": {
        "summary": "Derivatives by a start value, with another friction coefficient",
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
    """Outputs and their derivatives at the sample times; null means undefined."""

    time: list[float] = Field(description="s")
    outputs: list[str]
    units: list[str] = Field(description="Units of the outputs.")
    parameters: list[str]
    parameter_units: list[str]
    derivative_units: list[list[str]] = Field(description="Indexed by output and parameter.")
    values: list[list[float | None]] = Field(description="Indexed by sample and output.")
    derivatives: list[list[list[float | None]]] = Field(description="Indexed by sample, output and parameter.")
    notes: list[str]
    events: list[Moved]

    model_config = {"json_schema_extra": {"examples": [ANSWER]}}


@router.post(
    "/sensitivities",
    response_model=SensitivityDocument,
    responses=error_responses(413),
    openapi_extra=body_schema(SensitivityRequest, EXAMPLES),
)
async def compute_sensitivities(caller: Submitter, s: ServerState, request: Request) -> Response:
    """Return d(output)/d(parameter) along a run and across its events. The derivatives are exact, without finite differences. The
    computation ends if the client closes the connection."""
    document, seconds = await check_body(s, request, caller, plan_sensitivity)
    half = max(1, s.cluster.counted // 2)  # leaves workers for jobs and for views of results
    answer = await call_cluster(s, request, seconds + QUEUE_SECONDS, s.derivatives, half, run_sensitivity, document, seconds)
    return Response(answer, media_type="application/json")
