"""The request models of sensitivities and FMU exports."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from trunnion.analysis.sensitivities.request_checks import check_request
from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import Path, PlainText, SceneSource, scene_of, with_settings
from trunnion.simulation.settings.run_settings import settings_read

MOST_NUMBERS = 2_000_000
"""Largest count of numbers in one response, about 40 MB of JSON."""
SENSITIVITIES = "POST /v1/sensitivities"


class SensitivityRequest(with_settings(SENSITIVITIES)):  # type: ignore[misc]
    """A run whose outputs are differentiated with respect to parameters. ``rtol`` is the tolerance of the run. The derivatives are
    about a hundred times less accurate."""

    parameters: list[Path] = Field(max_length=100, description="Numbers of the scene, by dotted path.")
    outputs: list[PlainText] = Field(max_length=100, description="Columns, or patterns of columns.")
    budget: float | None = Field(None, gt=0, description="Time limit, s (default: the server's limit).")


class FmuRequest(SceneSource):
    """A scene that is exported as an FMU, with options."""

    flavour: Literal["native", "python"] = "native"
    platform: Literal["host", "linux64", "win64", "darwin64", "aarch64-darwin", "aarch64-linux", "all"] = "host"
    fmi: Literal[2, 3] = Field(2, description="2: FMI 2.0; 3: FMI 3.0 (native flavour only), with event mode and clocks.")


def plain(asked: SensitivityRequest, limits: Limits) -> tuple[dict[str, Any], float]:
    """The arguments for a worker, and the time budget, s. SceneError with all problems, including violated limits."""
    scene = scene_of(asked, limits)
    values, wrong = settings_read(SENSITIVITIES, asked.model_dump())
    problems: list[Problem] = []
    seconds = asked.budget or limits.answer_seconds
    if seconds > limits.answer_seconds:
        problems.append(_over("budget", f"{seconds:g} s", f"{limits.answer_seconds:g} s", "a smaller budget"))
    until = scene.simulation.until if values["until"] is None else values["until"]
    if until > limits.duration:
        problems.append(_over("until", f"{until:g} s", f"{limits.duration:g} s", "a shorter time"))
    try:
        chosen, end, every, _ = check_request(scene, asked.parameters, asked.outputs, **values)
        rows, width = end / every, len(chosen) * (1 + len(asked.parameters))
        if rows > limits.rows:
            problems.append(_over("every", f"{rows:.3g} samples", str(limits.rows), "a larger spacing"))
        if rows * width > MOST_NUMBERS:
            what, hint = f"{rows * width:.3g} numbers", "a larger spacing, or fewer outputs or parameters"
            problems.append(_over("outputs", what, str(MOST_NUMBERS), hint))
    except SceneError as e:
        problems += e.problems
    problems += wrong
    raise_problems(problems)
    return {"scene": scene_to_dict(scene), "parameters": asked.parameters, "outputs": asked.outputs, **values}, seconds


def _over(where: str, what: str, most: str, hint: str) -> Problem:
    return Problem(where, f"{what} is more than the {most} allowed", hint)
