"""Models, the scene format, checking a scene as it is typed, FMUs."""

from __future__ import annotations

import tempfile
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body
from fastapi import Path as InPath
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, Field
from starlette.responses import Response

from engine.basics.problems import Problem, SceneError
from engine.batch.reductions import DEFAULTS, reductions
from engine.kernel.columns import columns
from engine.scene.following import unused_notes
from engine.scene.library import bundled_names, model_file
from engine.scene.load import load_scene
from engine.scene.magnitudes import magnitude_notes
from engine.scene.model import Scene
from engine.scene.overrides import list_parameters
from engine.scene.schema import json_schema
from engine.system.build import build
from service.api.jobs import Here, Reader, Submitter
from service.api.problems import Json, Refusal, documented
from service.api.waiting import taking
from service.request import SceneSource, scene_of

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
    return Json([{"name": n, "title": load_scene(model_file(n)).title} for n in bundled_names()])


@router.get("/models/{name}", response_model=ModelText, responses=documented(404))
def model(name: Annotated[str, InPath(max_length=200)], caller: Reader) -> Response:
    """A bundled model's scene."""
    if name not in bundled_names():
        raise Refusal(404, "there is no such model")
    file = model_file(name)
    return Json({"name": name, "title": load_scene(file).title, "text": file.read_text(encoding="utf-8")})


@router.get("/schema", responses={200: {"content": {"application/json": {"schema": {"type": "object"}}}}, **documented()})
def schema(caller: Reader) -> Response:
    """The JSON Schema of scenes."""
    return Json(json_schema())


@router.post("/scenes/check", response_model=SceneFacts, responses=documented(413))
def check(source: Annotated[SceneSource, Body(openapi_examples=SCENES)], caller: Reader, s: Here) -> Response:
    """What a scene is: its numbers, its columns; or every problem it has (422), with lines."""
    scene = scene_of(source, s.settings.limits)
    built = build(scene)
    everything = columns(built.system)
    try:
        kept = [r.name for r in reductions((), everything)]
    except SceneError:
        kept = list(DEFAULTS)
    return Json(
        {
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
    )


EXPORTS_AT_ONCE = 2


class FmuRequest(SceneSource):
    """What to export as an FMU: the scene, and how."""

    flavour: Literal["native", "python"] = "native"
    platform: Literal["host", "linux64", "win64", "darwin64", "aarch64-darwin", "all"] = "host"


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
)
async def fmus(request: Annotated[FmuRequest, Body(openapi_examples=FMUS)], caller: Submitter, s: Here) -> Response:
    """Export a scene as an FMU (FMI 2.0) and download it."""
    scene = await run_in_threadpool(scene_of, request, s.settings.limits)
    async with taking(s.exports, EXPORTS_AT_ONCE):
        data = await run_in_threadpool(_exported, scene, request, s.settings.data)
    name = "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in scene.name)[:60] or "model"
    return Response(data, 200, {"Content-Disposition": f'attachment; filename="{name}.fmu"'}, "application/vnd.fmi.fmu")


def _exported(scene: Scene, request: FmuRequest, data: Path) -> bytes:
    """The bytes of the exported FMU."""
    export = _exporter()
    with tempfile.TemporaryDirectory(dir=data, prefix="fmu-") as folder:
        file = Path(folder) / "model.fmu"
        export(scene, file, flavour=request.flavour, platform=request.platform)
        return file.read_bytes()


def _exporter() -> Any:
    """The exporter of the package fmu; Refusal (501) when that package is not there."""
    try:
        return import_module("fmu.export").export
    except (ImportError, AttributeError) as e:
        hint = "pip install 'trunnion[fmu]' on the server"
        raise Refusal(501, "FMU export is not installed", [Problem("fmu", f"cannot be loaded: {e}", hint)]) from e
