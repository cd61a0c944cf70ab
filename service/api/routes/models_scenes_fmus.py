"""/v1/models, /v1/schema, /v1/scenes, /v1/fmus: bundled models, checks and views of scenes, FMU export."""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi import Path as InPath
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, Field
from starlette.responses import HTMLResponse, Response

from trunnion.basics.errors import Problem
from trunnion.scene.file_format.json_schema import json_schema
from trunnion.scene.library.model_folders import bundled_names, model_file
from trunnion.scene.scene_loader import load_scene
from trunnion.service.api.documents.problem_documents import Json, Refusal, content_schema, error_responses
from trunnion.service.api.transport.api_keys_and_rates import Reader, ServerState, Submitter
from trunnion.service.api.transport.request_bodies import body_schema, check_body
from trunnion.service.basics.json_text import text_of
from trunnion.service.request_models.job_request import SceneSource
from trunnion.service.request_models.sensitivity_and_fmu_requests import FmuRequest
from trunnion.service.request_workers import worker_tasks

router = APIRouter(prefix="/v1", tags=["scenes"])
YAML = """schema: 1
gravity: [0, -9.81, 0]
bodies:
  arm: {box: [0.6 m, 40 mm, 40 mm], density: 7800, points: {pivot: [-300 mm, 0, 0]}}
joints:
  pivot: {type: revolute, axis: z, inboard: ground, outboard: arm.pivot}
"""
SCENES: Any = {
    "name": {
        "summary": "A bundled model with changed numbers",
        "value": {"scene": "crank_slider", "overrides": {"gravity[3]": -1.62}},
    },
    "yaml": {"summary": "A scene as YAML text", "value": {"scene_text": YAML}},
}
EXPORTS = "pip install 'trunnion[fmu]' on the server"
FMUS: Any = {
    "native": {"summary": "An FMU for the platform of the server", "value": {"scene": "crank_slider", "flavour": "native"}}
}


class ModelItem(BaseModel):
    """Name and title of a bundled model."""

    name: str
    title: str


class ModelText(ModelItem):
    """A bundled model with its scene as YAML text."""

    text: str


class ParameterItem(BaseModel):
    """A number of a scene that can be varied."""

    path: str
    value: float
    unit: str
    at: tuple[int, int] | None = Field(
        description="First character and end of the number in the scene's text; null if the text does not contain it."
    )


class ColumnItem(BaseModel):
    """An output column of a scene."""

    name: str
    unit: str
    description: str


class SceneFacts(BaseModel):
    """Parameters and columns of a valid scene."""

    name: str
    title: str
    bodies: list[str]
    joints: dict[str, str] = Field(description="Type by name.")
    loops: int
    until: float
    parameters: list[ParameterItem]
    columns: list[ColumnItem]
    reductions: list[str] = Field(description="Default reductions of a job.")
    notes: list[str] = Field(description="Unusual values, such as a start angle of 90 rad.")


@router.get("/models", response_model=list[ModelItem], responses=error_responses())
def list_models(caller: Reader) -> Response:
    """List the bundled models."""
    return Json([{"name": n, "title": _title(n)} for n in bundled_names()])


@lru_cache(maxsize=256)
def _title(name: str) -> str:
    """The title of a bundled model. The title is cached, because only a new installation can change the title."""
    return load_scene(model_file(name)).title


@router.get("/models/{name}", response_model=ModelText, responses=error_responses(404))
def get_model(name: Annotated[str, InPath(max_length=200)], caller: Reader) -> Response:
    """Return the scene of a bundled model."""
    if name not in bundled_names():
        raise Refusal(404, "there is no such model")
    file = model_file(name)
    return Json({"name": name, "title": _title(name), "text": file.read_text(encoding="utf-8")})


@router.get("/schema", responses={200: content_schema("application/json"), **error_responses()})
def get_scene_schema(caller: Reader) -> Response:
    """Return the JSON Schema of scenes."""
    return Response(_schema(), media_type="application/json")


@lru_cache(maxsize=1)
def _schema() -> bytes:
    return text_of(json_schema())


@router.post(
    "/scenes/check", response_model=SceneFacts, responses=error_responses(413), openapi_extra=body_schema(SceneSource, SCENES)
)
async def check_scene(request: Request, caller: Reader, s: ServerState) -> Response:
    """Check a scene. Return its parameters and columns, or (422) all problems with their lines."""
    return Response(await check_body(s, request, caller, worker_tasks.check_scene), media_type="application/json")


@router.post(
    "/scenes/view",
    response_class=HTMLResponse,
    responses={
        200: {"description": "A self-contained page.", **content_schema("text/html", "string")},
        **error_responses(413),
    },
    openapi_extra=body_schema(SceneSource, SCENES),
)
async def view_scene(
    request: Request,
    caller: Reader,
    s: ServerState,
    shown: Annotated[str, Query(max_length=200, pattern=r"^[\w=&.-]*$", description="Initial view, such as names=1&xray=1.")] = "",
) -> Response:
    """Return an interactive view of the assembled start of a scene (bodies, pins, contact points, forces), or (422) all
    problems."""
    return HTMLResponse(await check_body(s, request, caller, worker_tasks.draw_scene, shown))


@router.post(
    "/scenes/run",
    responses={
        200: {"description": "Rows, meshes and events for the animation's viewer.", **content_schema("application/json")},
        **error_responses(413),
    },
    openapi_extra=body_schema(SceneSource, SCENES),
)
async def run_scene(
    request: Request,
    caller: Reader,
    s: ServerState,
    held: Annotated[bool, Query(description="Whether view and scales are omitted, because the viewer keeps its own.")] = False,
) -> Response:
    """Run a scene at once, without a job. Return the motion, or (422) all problems. A run that needs more than 2 s of processor
    time ends early."""
    return Response(await check_body(s, request, caller, worker_tasks.run_scene, held, pool=s.runs), media_type="application/json")


@router.post(
    "/scenes/module",
    responses={
        200: {"description": "Code in base64, and the numbers of variables by name.", **content_schema("application/json")},
        **error_responses(413, 501),
    },
    openapi_extra=body_schema(SceneSource, SCENES),
)
async def export_module(request: Request, caller: Submitter, s: ServerState) -> Response:
    """Export a scene as a WebAssembly module with the functions of `trunnion export web`. The first export of a scene takes up to a
    minute, because the module is compiled."""
    seconds = s.settings.limits.answer_seconds
    try:
        made = await check_body(s, request, caller, worker_tasks.export_module, pool=s.exports, seconds=seconds)
    except ImportError as e:
        raise Refusal(501, "the export is not installed", [Problem("scene", str(e), EXPORTS)]) from e
    return Response(made, media_type="application/json")


@router.post(
    "/fmus",
    response_class=Response,
    responses={
        200: {"description": "The FMU.", **content_schema("application/vnd.fmi.fmu", "string", format="binary")},
        **error_responses(413, 501),
    },
    openapi_extra=body_schema(FmuRequest, FMUS),
)
async def export_fmu(request: Request, caller: Submitter, s: ServerState) -> Response:
    """Export a scene as an FMU and return the file. The server's settings ``answer_seconds`` and ``memory`` limit the export."""
    seconds = s.settings.limits.answer_seconds
    with tempfile.TemporaryDirectory(dir=s.settings.data, prefix="fmu-") as folder:
        file = Path(folder) / "model.fmu"
        try:
            name = await check_body(s, request, caller, worker_tasks.export_fmu, str(file), pool=s.exports, seconds=seconds)
        except ImportError as e:
            raise Refusal(501, "FMU export is not installed", [Problem("fmu", str(e), EXPORTS)]) from e
        data = await run_in_threadpool(file.read_bytes)
    return Response(data, 200, {"Content-Disposition": f'attachment; filename="{name}.fmu"'}, "application/vnd.fmi.fmu")
