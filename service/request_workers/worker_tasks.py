"""The tasks of the worker processes, which parse, check and plan requests. The first arguments of a task are the body of the
request, its media type, and the limits. This module imports no web framework."""

from __future__ import annotations

import base64
import json
from importlib import import_module
from pathlib import Path
from time import thread_time
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from trunnion.basics.control_characters import visible
from trunnion.basics.errors import Problem, SceneError
from trunnion.basics.interrupts import watched
from trunnion.basics.renamed_words import deprecation_notes
from trunnion.scene.file_format.yaml_reader import read
from trunnion.scene.findings.findings_and_paths import dotted
from trunnion.service.basics.json_text import text_of
from trunnion.service.basics.server_settings import Limits
from trunnion.service.executor.part_versions import with_version
from trunnion.service.request_models.job_request import JobRequest, SceneSource, document_of, identity_of, plan_of_request, scene_of
from trunnion.service.request_models.sensitivity_and_fmu_requests import FmuRequest, SensitivityRequest, plain
from trunnion.service.request_models.validation_messages import problem_of

M = TypeVar("M", bound=BaseModel)


def read_request(model: type[M], body: bytes, media: str) -> M:
    """The request in a body; SceneError with all problems."""
    kind = media.partition(";")[0].strip().lower()
    if body and not (kind == "application/json" or (kind.startswith("application/") and kind.endswith("+json"))):
        raise SceneError([Problem("body", "the body is not declared as JSON", "add the header Content-Type: application/json")])
    try:
        data = json.loads(body) if body else None
    except json.JSONDecodeError as e:
        raise SceneError([Problem("body", f"invalid JSON: {e.msg}, at character {e.pos}"[:500])]) from None
    except (ValueError, RecursionError) as e:
        raise SceneError([Problem("body", f"invalid JSON: {e}"[:500])]) from None
    return validate_request(model, data)


def validate_request(model: type[M], data: Any) -> M:
    """The request in plain data; SceneError with all problems."""
    try:
        return model.model_validate(data)
    except ValidationError as e:
        raise SceneError(map(problem_of, e.errors(include_url=False))) from None
    except RecursionError:
        raise SceneError([Problem("body", "the body is nested too deeply")]) from None


def check_scene(body: bytes, media: str, limits: Limits) -> bytes:
    """JSON of the parameters and columns of a scene."""
    from trunnion.batch.tables.reductions import DEFAULTS, reductions
    from trunnion.kernel.interface.output_columns import columns
    from trunnion.scene.checks.unusual_magnitudes import magnitude_notes
    from trunnion.scene.expressions.parameter_dependence import unused_notes
    from trunnion.scene.overrides import list_parameters
    from trunnion.system.construction.system_builder import build

    asked = read_request(SceneSource, body, media)
    with deprecation_notes() as deprecated:
        scene = scene_of(asked, limits)
    places = number_places(asked.scene_text) if asked.scene_text and not asked.overrides else {}
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
        "loops": len(built.system.cuts) - len(built.system.light),
        "until": float(scene.simulation.until),
        "parameters": [
            {"path": p.path, "value": p.value, "unit": p.unit, "at": places.get(p.path)} for p in list_parameters(scene)
        ],
        "columns": [{"name": c.name, "unit": c.unit, "description": c.description} for c in everything],
        "reductions": kept,
        "notes": [*deprecated, *magnitude_notes(scene), *unused_notes(scene)],
    }
    return text_of(facts)


def number_places(text: str) -> dict[str, tuple[int, int]]:
    """The positions of the first and last character of each scalar of a scene's text, such as a number, by dotted path. An entry
    without a list is also the first entry of a list. Characters are counted in UTF-16, as browsers do."""
    found = {dotted(path): ends for path, ends in read(text).places.items()}
    if any(ord(c) > 0xFFFF for c in text):
        found = {p: (_utf16(text[:a]), _utf16(text[:b])) for p, (a, b) in found.items()}
    return {f"{p}[1]": ends for p, ends in found.items()} | found


def _utf16(text: str) -> int:
    return len(text.encode("utf-16-le", "surrogatepass")) // 2


def draw_scene(body: bytes, media: str, limits: Limits, shown: str) -> bytes:
    """An HTML page that shows the assembled start of a scene."""
    from trunnion.plots.animation.html_or_film import page
    from trunnion.plots.mechanism_pictures.instant_picture import assemble_start

    return page(assemble_start(scene_of(read_request(SceneSource, body, media), limits), "scene"), shown).encode()


RUN_SECONDS, RUN_ROWS = 2.0, 1000
"""Longest processor time, s, and largest number of rows of a run that is shown at once."""


def run_scene(body: bytes, media: str, limits: Limits, held: bool) -> bytes:
    """JSON of the motion of a scene, in the form that the animation's viewer draws. A run that uses RUN_SECONDS ends early with the
    outcome ``cancelled``. held: as for ``content``."""
    from trunnion.plots.animation.viewer_data import content
    from trunnion.plots.mechanism_pictures.instant_picture import needed, started
    from trunnion.simulation.run import simulate

    scene = scene_of(read_request(SceneSource, body, media), limits)
    until, every, end = float(scene.simulation.until), float(scene.simulation.every or 0.0), thread_time() + RUN_SECONDS

    def check() -> None:
        if thread_time() > end:
            raise KeyboardInterrupt

    try:
        with watched(check):
            result = simulate(scene, every=max(every, until / RUN_ROWS), outputs=needed(scene), kernel="parts")
    except KeyboardInterrupt:
        raise SceneError([Problem("scene", f"no row was computed within {RUN_SECONDS:g} s", "submit it as a job")]) from None
    return text_of(content(started(result, "scene"), held))


def check_job(body: bytes, media: str, limits: Limits) -> bytes:
    """JSON of the number of cases and the columns of a job."""
    made = plan_of_request(read_request(JobRequest, body, media), limits)
    return text_of({"cases": made.cases.count, "columns": with_version(made.schema).names})


def plan_job(body: bytes, media: str, limits: Limits) -> dict[str, Any]:
    """The arguments of ``Store.submit`` for a job."""
    return stored_fields(read_request(JobRequest, body, media), limits)


def stored_fields(request: JobRequest, limits: Limits) -> dict[str, Any]:
    """The arguments of ``Store.submit`` for a request; SceneError with all problems."""
    made = plan_of_request(request, limits)
    return {
        "digest": identity_of(request),
        "scene": visible(made.scene.name)[:200],
        "label": request.label,
        "tags": request.tags,
        "notify": request.notify,
        "document": json.dumps(document_of(request, made)),
        "cases": made.cases.count,
        "asked": 0 if request.optimise or request.refine else None,
        "budget": request.budget or limits.job_seconds,
    }


def plan_sensitivity(body: bytes, media: str, limits: Limits) -> tuple[dict[str, Any], float]:
    """The arguments of ``run_sensitivity`` for a worker: the request as plain data, and the time budget, s."""
    return plain(read_request(SensitivityRequest, body, media), limits)


def export_module(body: bytes, media: str, limits: Limits) -> bytes:
    """JSON of the WebAssembly module of a scene: its code in base64, and the numbers of its parameters and columns by name."""
    from trunnion.plots.mechanism_pictures.instant_picture import needed

    scene = scene_of(read_request(SceneSource, body, media), limits)
    try:
        library = import_module("trunnion.fmu.c_library.library_files").library
        wasm = import_module("trunnion.fmu.c_library.wasm_page").wasm
    except (ImportError, AttributeError) as e:
        raise ImportError(f"cannot be loaded: {e}") from None
    made = library(scene, None, needed(scene))
    numbered: dict[str, dict[str, int]] = {"parameters": {}, "columns": {}}
    for i, v in enumerate(made.called.values()):
        numbered["parameters" if v.causality == "parameter" else "columns"][v.name] = i
    return text_of({"wasm": base64.b64encode(wasm(made)).decode(), **numbered})


def export_fmu(body: bytes, media: str, limits: Limits, file: str) -> str:
    """Write an FMU to a file. Returns the name, without suffix, under which the client gets the file."""
    request = read_request(FmuRequest, body, media)
    scene = scene_of(request, limits)
    try:
        export = import_module("trunnion.fmu.scene_export").export
    except (ImportError, AttributeError) as e:
        raise ImportError(f"cannot be loaded: {e}") from None
    export(scene, Path(file), flavour=request.flavour, platform=request.platform, fmi=request.fmi)
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in scene.name)[:60] or "model"
