"""What a client may ask for: a job's request, checked against the limits, and the plan it stands for."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from math import isfinite
from typing import Annotated, Any

from pydantic import Field, StringConstraints, WithJsonSchema, create_model

from engine.basics.numbers import Bound
from engine.basics.problems import Problem, SceneError
from engine.basics.settings import offered
from engine.batch.plan import Plan, Run, plan
from engine.scene.dump import scene_to_dict
from engine.scene.library import bundled_names, model_file
from engine.scene.load import load_scene, scene_from_dict, scene_from_text
from engine.scene.model import Scene
from engine.scene.overrides import apply
from engine.simulation.settings import settings_given, settings_read, told
from engine.studies.asked import study_of, with_values
from engine.studies.following import Study, Told
from service.fits import Fit, fit_of_document, fit_of_request
from service.limited import too_dear, too_long, too_long_varied, too_many_rows
from service.settings import Limits
from service.ways import Asked, Number, Optimise, Path, Plain, Refine, Sample, Tag, Text, wanted_of

JOBS = "POST /v1/jobs"
WAYS = "give exactly one of over, cases, sample, optimise, refine and fit"
MOST_TEXT, MOST_VALUES = 250_000, 100_000
"""Characters and values (keys too) of a scene: ten times as many as the largest that is allowed to run needs."""


def _values(data: Any) -> int:
    """How many keys and values plain data hold."""
    todo, n = [data], 0
    while todo:
        value = todo.pop()
        n += 2 * len(value) if isinstance(value, dict) else len(value) if isinstance(value, list) else 0
        todo += value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return n


class SceneSource(Asked):
    """A scene: the name of a bundled model, or a scene as JSON (``scene``), or as YAML text (``scene_text``)."""

    scene: Plain | dict[str, Any] | None = Field(None, description="Name of a bundled model, or a whole scene as JSON.")
    scene_text: Annotated[str, StringConstraints(max_length=MOST_TEXT)] | None = Field(
        None, description="A whole scene as YAML text."
    )
    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=1000, description="Changes by dotted path.")


def with_settings(who: str) -> Any:
    """A scene and the settings of its run that ``who`` offers, as fields; their bounds are in the schema, and are checked where
    those of everybody are."""
    fields: dict[str, Any] = {}
    for s in offered(who):
        kind = Plain if s.words else Annotated[float, WithJsonSchema(_schema(s.bound_at(who)))] | Text
        fields[s.name] = (kind | None, Field(None, description=told(s, who)))
    return create_model("WithSettings", __base__=SceneSource, **fields)


def _schema(bound: Bound) -> dict[str, Any]:
    """A number within a bound, as JSON Schema."""
    least = {"exclusiveMinimum" if bound.open else "minimum": bound.least} if isfinite(bound.least) else {}
    return {"type": "number"} | least | ({"maximum": bound.most} if isfinite(bound.most) else {})


class JobRequest(with_settings(JOBS)):  # type: ignore[misc]
    """A batch: one scene, exactly one of ``over`` (grid), ``cases`` (list), ``sample``, ``optimise``, ``refine`` and ``fit``, and
    what to keep of each case."""

    over: dict[Path, list[Number] | Number] | None = Field(
        None,
        max_length=100,
        description='Grid: values by path, a list or "first:last:count"; every combination, the last path fastest.',
    )
    cases: list[dict[Path, Number]] | None = Field(None, min_length=1, description="List: each case's values by path.")
    sample: Sample | None = None
    optimise: Optimise | None = None
    refine: Refine | None = None
    fit: Fit | None = None
    reductions: list[Plain] = Field(
        default_factory=list,
        max_length=500,
        description="max:PATTERN, min:, mean:, final: of columns; first:EVENT, count:EVENT (stick, …, any); error:… of each.",
    )
    trajectories: list[Plain] = Field(
        default_factory=list, max_length=100, description="Columns (patterns) whose rows are kept of every case while it runs."
    )
    spacing: float | None = Field(None, gt=0, description="How far apart the rows kept are, s; all rows where it is not given.")
    certify: bool = Field(False, description="Whether the error of each reduction is kept, as `error:…`; why none: `error.why`.")
    budget: float | None = Field(
        None, gt=0, description="Seconds of building and stepping, all workers together, after which the job is stopped."
    )
    label: Plain = Field("", description="Words of your own.")
    notify: Plain = Field("", description="Where its end is told: an address below one the server was started with.")
    tags: list[Tag] = Field(default_factory=list, max_length=20, description="Words to find it by.")


def scene_of(source: SceneSource, limits: Limits) -> Scene:
    """The scene a request names; SceneError with every problem. Only names of bundled models and inline scenes: never a file."""
    given = [x for x in (source.scene, source.scene_text) if x is not None]
    if len(given) != 1:
        what = "no scene is given" if not given else "two scenes are given"
        raise SceneError([Problem("scene", what, "give scene (a model's name, or JSON) or scene_text (YAML)")])
    if isinstance(source.scene, dict) and (n := _values(source.scene)) > MOST_VALUES:
        raise SceneError([Problem("scene", f"it holds {n} values, more than {MOST_VALUES}", "leave out what is not needed")])
    if isinstance(source.scene, str):
        if source.scene not in bundled_names():
            hint = f"one of {', '.join(bundled_names())}; or give the scene itself"
            raise SceneError([Problem("scene", f"there is no bundled model {source.scene!r}", hint)])
        scene = load_scene(model_file(source.scene))
    elif source.scene is not None:
        scene = scene_from_dict(source.scene)
    else:
        scene = scene_from_text(source.scene_text or "", name="scene")
    if source.overrides:
        scene = apply(scene, source.overrides)
    if len(scene.bodies) > limits.bodies:
        raise SceneError(
            [Problem("bodies", f"{len(scene.bodies)} bodies are more than the {limits.bodies} allowed", "ask for a higher limit")]
        )
    return scene


def plan_of_request(request: JobRequest, limits: Limits) -> Plan:
    """The plan; SceneError with every problem, those of limits included."""
    scene = scene_of(request, limits)
    asked = request.model_dump(exclude={"scene", "scene_text", "overrides"})
    values, problems = settings_read(JOBS, asked)
    problems += too_dear(request.budget, limits)
    if request.fit is not None:
        return fit_of_request(scene, asked, values["rtol"], problems, limits)
    run = replace(Run(**values), patience=values["patience"] or limits.patience, steps=values["steps"] or limits.steps)
    problems += too_long(run, scene, limits)
    try:
        made = _planned(scene, asked, run, limits.cases)
    except SceneError as e:
        told = {p.where for p in problems}
        raise SceneError([*problems, *(p for p in e.problems if p.where not in told)]) from None
    problems += too_long_varied(made, limits)
    width = len(made.cases.paths) + len(made.reductions) + 6
    if made.cases.count * width * 8 > limits.output_bytes:
        what = f"{made.cases.count} cases of {width} columns are more than the {limits.output_bytes:.3g} bytes allowed"
        problems.append(Problem("reductions", what, "keep fewer reductions, or split the batch"))
    problems += too_many_rows(made, limits)
    if problems:
        raise SceneError(problems)
    return made


def study_of_document(document: dict[str, Any]) -> Study | None:
    """The study of a document that was kept; None where it is a batch whose cases are all known."""
    wanted = wanted_of(document)
    if wanted is None:
        return None
    return study_of(scene_from_dict(document["scene"]), wanted, document["reductions"], Run(**settings_given(JOBS, document)))[0]


def _planned(scene: Scene, asked: dict[str, Any], run: Run, most: int | None) -> Plan:
    """The plan of a scene and of the request's other fields; the numbers of a study's cases are told to it (``Told``)."""
    if (wanted := wanted_of(asked)) is not None:
        ways = [asked[n] for n in ("over", "cases", "sample", "optimise", "refine") if asked.get(n) is not None]
        wrong = [Problem("over", "more than one way of saying what varies", WAYS)] if len(ways) > 1 else []
        for name, what in (("trajectories", "rows"), ("certify", "errors")):
            if asked.get(name):
                wrong.append(Problem(name, f"{what} of a study's cases are not kept", "ask for single cases"))
        if most is not None and wanted.cases > most:
            wrong.append(Problem("cases", f"{wanted.cases} cases are more than the {most} allowed", "ask for a higher limit"))
        made, planned = study_of(scene, wanted, asked["reductions"], run, wrong)
        return with_values(made, planned, Told())
    sample = asked["sample"] or {}
    return plan(
        scene,
        asked["over"],
        asked["cases"],
        sample.get("ranges"),
        count=sample.get("count", 0),
        seed=sample.get("seed", 0),
        sampling=sample.get("method", "latin"),
        keep=asked["reductions"],
        run=run,
        trajectories=asked.get("trajectories") or (),
        most=most,
        **{n: asked[n] for n in ("spacing", "certify") if n in asked},
    )


def document_of(request: JobRequest, made: Plan) -> dict[str, Any]:
    """The request as it is kept: the scene itself in place of its name and changes, so that it means the same for ever, and what
    each case may take."""
    asked = request.model_dump(mode="json", exclude={"scene", "scene_text", "overrides", "notify"})
    return asked | {"scene": scene_to_dict(made.scene), "patience": made.run.patience, "steps": made.run.steps}


def plan_of_document(document: dict[str, Any]) -> Plan:
    """The plan of a document that was kept."""
    scene, values = scene_from_dict(document["scene"]), settings_given(JOBS, document)
    if document.get("fit") is not None:
        return fit_of_document(scene, document, values["rtol"])
    return _planned(scene, document, Run(**values), None)


def digest(value: Any) -> str:
    """Content digest of plain data."""
    return hashlib.sha256(json.dumps(value, sort_keys=True, ensure_ascii=True).encode()).hexdigest()
