"""Models, the scene format, checking a scene as it is typed, FMUs."""

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

from engine.basics.problems import Problem
from engine.scene.library import bundled_names, model_file
from engine.scene.load import load_scene
from engine.scene.schema import json_schema
from service.answered import FmuRequest
from service.api.bodies import asks, at_desk, body_of, media_of, told
from service.api.jobs import Here, Reader, Submitter
from service.api.problems import Json, Refusal, documented
from service.plain import text_of
from service.request import SceneSource

router = APIRouter(prefix="/v1", tags=["scenes"])
YAML = """schema: 1
gravity: [0, -9.81, 0]
bodies:
  arm: {box: [0.6 m, 40 mm, 40 mm], density: 7800, points: {pivot: [-300 mm, 0, 0]}}
joints:
  pivot: {type: revolute, axis: z, inboard: ground, outboard: arm.pivot}
"""
SCENES: Any = {
    "name": {"summary": "A bundled model, changed", "value": {"scene": "crank_slider", "overrides": {"gravity[3]": -1.62}}},
    "yaml": {"summary": "A scene as YAML text", "value": {"scene_text": YAML}},
}
FMUS: Any = {"native": {"summary": "For the machine of the server", "value": {"scene": "crank_slider", "flavour": "native"}}}


class ModelItem(BaseModel):
    """A bundled model by name, with its title."""

    name: str
    title: str


class ModelText(ModelItem):
    """A bundled model with its scene as YAML text."""

    text: str


class ParameterItem(BaseModel):
    """A number of a scene that can be swept."""

    path: str
    value: float
    unit: str


class ColumnItem(BaseModel):
    """A column a run of the scene can give."""

    name: str
    unit: str
    description: str


class SceneFacts(BaseModel):
    """What is known about a scene without problems: its numbers and its columns."""

    name: str
    title: str
    bodies: list[str]
    joints: dict[str, str] = Field(description="Type by name.")
    loops: int
    until: float
    parameters: list[ParameterItem]
    columns: list[ColumnItem]
    reductions: list[str] = Field(description="Kept when a job names none.")
    notes: list[str] = Field(description="Numbers that are allowed but seldom meant, such as a start angle of 90 rad.")


@router.get("/models", response_model=list[ModelItem], responses=documented())
def models(caller: Reader) -> Response:
    """List the bundled models."""
    return Json([{"name": n, "title": _title(n)} for n in bundled_names()])


@lru_cache(maxsize=256)
def _title(name: str) -> str:
    """What a bundled model is called: read once, they change with the installation only."""
    return load_scene(model_file(name)).title


@router.get("/models/{name}", response_model=ModelText, responses=documented(404))
def model(name: Annotated[str, InPath(max_length=200)], caller: Reader) -> Response:
    """A bundled model's scene."""
    if name not in bundled_names():
        raise Refusal(404, "there is no such model")
    file = model_file(name)
    return Json({"name": name, "title": _title(name), "text": file.read_text(encoding="utf-8")})


@router.get("/schema", responses={200: {"content": {"application/json": {"schema": {"type": "object"}}}}, **documented()})
def schema(caller: Reader) -> Response:
    """The JSON Schema of scenes."""
    return Response(_schema(), media_type="application/json")


@lru_cache(maxsize=1)
def _schema() -> bytes:
    return text_of(json_schema())


@router.post("/scenes/check", response_model=SceneFacts, responses=documented(413), openapi_extra=asks(SceneSource, SCENES))
async def check(request: Request, caller: Reader, s: Here) -> Response:
    """What a scene is: its numbers, its columns; or every problem it has (422), with lines."""
    return Response(await told(s, request, caller, "check_scene"), media_type="application/json")


@router.post(
    "/scenes/view",
    response_class=HTMLResponse,
    responses={
        200: {"description": "A page by itself.", "content": {"text/html": {"schema": {"type": "string"}}}},
        **documented(413),
    },
    openapi_extra=asks(SceneSource, SCENES),
)
async def view(
    request: Request,
    caller: Reader,
    s: Here,
    shown: Annotated[str, Query(max_length=200, pattern=r"^[\w=&.-]*$", description="How it opens, such as names=1&xray=1.")] = "",
) -> Response:
    """The assembled start of a scene, to be turned: bodies, pins, contact places, forces; or every problem it has (422)."""
    body, limits = await body_of(request), s.settings.limits
    given = (body, media_of(request), limits, shown)
    return HTMLResponse(await at_desk(s.checks, caller, "draw_scene", *given, seconds=limits.check_seconds))


@router.post(
    "/fmus",
    response_class=Response,
    responses={
        200: {
            "description": "The FMU.",
            "content": {"application/vnd.fmi.fmu": {"schema": {"type": "string", "format": "binary"}}},
        },
        **documented(413, 501),
    },
    openapi_extra=asks(FmuRequest, FMUS),
)
async def fmus(request: Request, caller: Submitter, s: Here) -> Response:
    """Export a scene as an FMU and download it; compiling it gets the server's ``answer_seconds`` and ``memory``."""
    body, seconds = await body_of(request), s.settings.limits.answer_seconds
    with tempfile.TemporaryDirectory(dir=s.settings.data, prefix="fmu-") as folder:
        file = Path(folder) / "model.fmu"
        given = (body, media_of(request), s.settings.limits, str(file))
        try:
            name = await at_desk(s.exports, caller, "export_fmu", *given, seconds=seconds)
        except ImportError as e:
            hint = "pip install 'trunnion[fmu]' on the server"
            raise Refusal(501, "FMU export is not installed", [Problem("fmu", str(e), hint)]) from e
        data = await run_in_threadpool(file.read_bytes)
    return Response(data, 200, {"Content-Disposition": f'attachment; filename="{name}.fmu"'}, "application/vnd.fmi.fmu")
