"""/v1/sensitivities: derivatives of outputs by parameters along one run."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, Field

from engine.basics.problems import Problem, SceneError
from engine.scene.dump import scene_to_dict
from engine.sensitivities.asked import checked_request
from engine.simulation.settings import settings_read
from service.api.jobs import Here, Submitter
from service.api.problems import documented
from service.api.waiting import Call, answered
from service.executor.differentiate import run_sensitivity
from service.request import Path, Plain, scene_of, with_settings
from service.settings import Limits

router = APIRouter(prefix="/v1", tags=["sensitivities"])
MOST_NUMBERS = 2_000_000
"""Most numbers in one answer; they make about 40 MB of JSON."""
QUEUE_SECONDS = 60
"""Time a request may wait for its turn, beside its own budget."""
HERE = "POST /v1/sensitivities"
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


class SensitivityRequest(with_settings(HERE)):  # type: ignore[misc]
    """A run to differentiate: the scene, the parameters and the outputs. ``rtol`` is that of the run underneath; derivatives are
    about a hundred times less accurate."""

    parameters: list[Path] = Field(max_length=100, description="Numbers of the scene, by dotted path.")
    outputs: list[Plain] = Field(max_length=100, description="Columns, or patterns of them.")
    budget: float | None = Field(None, gt=0, description="Seconds after which it is given up (default: the server's limit).")


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


@router.post("/sensitivities", response_model=SensitivityDocument, responses=documented(413))
async def sensitivities(
    asked: Annotated[SensitivityRequest, Body(openapi_examples=EXAMPLES)], caller: Submitter, s: Here, request: Request
) -> Response:
    """d(output)/d(parameter) along a run and across its events, exactly along its steps (no differences of runs). The answer comes
    with this request; closing the connection ends the work."""
    document, seconds = await run_in_threadpool(_plain, asked, s.settings.limits)
    half = max(1, s.cluster.counted // 2)  # the other workers are for jobs, and for looking at them
    call = Call(run_sensitivity, (document, seconds), s.derivatives, half)
    answer = await answered(s, request, seconds + QUEUE_SECONDS, call)
    return Response(answer, media_type="application/json")


def _plain(asked: SensitivityRequest, limits: Limits) -> tuple[dict[str, Any], float]:
    """(arguments for a worker, its time budget in s). SceneError with every problem, those of limits included."""
    scene = scene_of(asked, limits)
    values, wrong = settings_read(HERE, asked.model_dump())
    problems: list[Problem] = []
    seconds = asked.budget or limits.answer_seconds
    if seconds > limits.answer_seconds:
        problems.append(_over("budget", f"{seconds:g} s", f"{limits.answer_seconds:g} s", "a smaller budget"))
    until = scene.simulation.until if values["until"] is None else values["until"]
    if until > limits.duration:
        problems.append(_over("until", f"{until:g} s", f"{limits.duration:g} s", "a shorter time"))
    try:
        chosen, end, every, _ = checked_request(scene, asked.parameters, asked.outputs, **values)
        rows, width = end / every, len(chosen) * (1 + len(asked.parameters))
        if rows > limits.rows:
            problems.append(_over("every", f"{rows:.3g} samples", str(limits.rows), "a larger spacing"))
        if rows * width > MOST_NUMBERS:
            what, hint = f"{rows * width:.3g} numbers", "a larger spacing, or fewer outputs or parameters"
            problems.append(_over("outputs", what, str(MOST_NUMBERS), hint))
    except SceneError as e:
        problems += e.problems
    problems += wrong
    if problems:
        raise SceneError(problems)
    return {"scene": scene_to_dict(scene), "parameters": asked.parameters, "outputs": asked.outputs, **values}, seconds


def _over(where: str, what: str, most: str, hint: str) -> Problem:
    return Problem(where, f"{what} is more than the {most} allowed", hint)
