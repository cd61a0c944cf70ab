"""What clerks do: requests as their bytes came in are read, checked and understood. Nothing of the web is loaded here."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from engine.basics.problems import Problem, SceneError
from service.answered import FmuRequest, SensitivityRequest, plain
from service.plain import text_of
from service.request import JobRequest, SceneSource, digest, document_of, plan_of_request, scene_of
from service.settings import Limits

M = TypeVar("M", bound=BaseModel)
TASKS: dict[str, Callable[..., Any]] = {}
"""Each takes the body, its media type and the limits first."""


def task(work: Callable[..., Any]) -> Callable[..., Any]:
    """Offer a function by its name."""
    TASKS[work.__name__] = work
    return work


def read(model: type[M], body: bytes, media: str) -> M:
    """A request; SceneError with everything that is wrong with it."""
    kind = media.partition(";")[0].strip().lower()
    if body and not (kind == "application/json" or (kind.startswith("application/") and kind.endswith("+json"))):
        raise SceneError([Problem("body", "it was not sent as JSON", "add the header Content-Type: application/json")])
    try:
        data = json.loads(body) if body else None
    except json.JSONDecodeError as e:
        raise SceneError([Problem("body", f"it is no JSON: {e.msg}, at character {e.pos}"[:500])]) from None
    except (ValueError, RecursionError) as e:
        raise SceneError([Problem("body", f"it is no JSON that can be read: {e}"[:500])]) from None
    return understood(model, data)


def understood(model: type[M], data: Any) -> M:
    """Plain data as a request; SceneError with everything that is wrong with it."""
    try:
        return model.model_validate(data)
    except ValidationError as e:
        raise SceneError(map(_of_validation, e.errors(include_url=False, include_input=False))) from None
    except RecursionError:
        raise SceneError([Problem("body", "it is nested too deeply")]) from None


def _of_validation(e: Any) -> Problem:
    """One of pydantic's errors as a problem."""
    return Problem(".".join(map(str, e["loc"]))[:300] or "body", str(e["msg"])[:500])


@task
def check_scene(body: bytes, media: str, limits: Limits) -> bytes:
    """What a scene is, as JSON: its numbers, its columns."""
    from engine.batch.reductions import DEFAULTS, reductions
    from engine.kernel.columns import columns
    from engine.scene.following import unused_notes
    from engine.scene.magnitudes import magnitude_notes
    from engine.scene.overrides import list_parameters
    from engine.system.build import build

    scene = scene_of(read(SceneSource, body, media), limits)
    built = build(scene)
    everything = columns(built.system)
    try:
        kept = [r.name for r in reductions((), everything)]
    except SceneError:
        kept = list(DEFAULTS)
    facts = {
        "name": scene.name,
        "title": scene.title,
        "bodies": list(scene.bodies),
        "joints": {n: j.type for n, j in scene.joints.items()},
        "loops": len(built.system.cuts),
        "until": float(scene.simulation.until),
        "parameters": [{"path": p.path, "value": p.value, "unit": p.unit} for p in list_parameters(scene)],
        "columns": [{"name": c.name, "unit": c.unit, "description": c.description} for c in everything],
        "reductions": kept,
        "notes": [*magnitude_notes(scene), *unused_notes(scene)],
    }
    return text_of(facts)


@task
def draw_scene(body: bytes, media: str, limits: Limits, shown: str) -> bytes:
    """The page of a scene's assembled start."""
    from engine.plots.begun import start_page

    return start_page(scene_of(read(SceneSource, body, media), limits), shown).encode()


@task
def check_job(body: bytes, media: str, limits: Limits) -> bytes:
    """What a job would make, as JSON."""
    made = plan_of_request(read(JobRequest, body, media), limits)
    return text_of({"cases": made.cases.count, "columns": made.schema.names})


@task
def plan_job(body: bytes, media: str, limits: Limits) -> dict[str, Any]:
    """What the store keeps of a job, as arguments of ``Store.submit``."""
    return kept_of(read(JobRequest, body, media), limits)


def kept_of(request: JobRequest, limits: Limits) -> dict[str, Any]:
    """What the store keeps of a request; SceneError with everything that is wrong with it."""
    made = plan_of_request(request, limits)
    return {
        "digest": digest(request.model_dump(mode="json")),
        "scene": "".join(c for c in made.scene.name if c.isprintable())[:200],
        "label": request.label,
        "tags": request.tags,
        "notify": request.notify,
        "document": json.dumps(document_of(request, made)),
        "cases": made.cases.count,
        "asked": 0 if request.optimise or request.refine else None,
        "budget": request.budget or limits.job_seconds,
    }


@task
def plain_sensitivity(body: bytes, media: str, limits: Limits) -> tuple[dict[str, Any], float]:
    """What a worker needs for derivatives, and for how long it may work."""
    return plain(read(SensitivityRequest, body, media), limits)


@task
def export_fmu(body: bytes, media: str, limits: Limits, file: str) -> str:
    """Write an FMU into a file; a name for it."""
    request = read(FmuRequest, body, media)
    scene = scene_of(request, limits)
    try:
        export = import_module("fmu.export").export
    except (ImportError, AttributeError) as e:
        raise ImportError(f"cannot be loaded: {e}") from None
    export(scene, Path(file), flavour=request.flavour, platform=request.platform, fmi=request.fmi)
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in scene.name)[:60] or "model"
