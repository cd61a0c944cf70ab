"""The request model of a job, checks of its limits, and its plan."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isfinite
from typing import Annotated, Any

import numpy as np
from pydantic import Field, StringConstraints, WithJsonSchema, create_model

from trunnion.analysis.studies.request import make_study, with_case_values
from trunnion.analysis.studies.study_rounds import ReportedCases, Study
from trunnion.basics.errors import Problem, SceneError, raise_problems
from trunnion.basics.number_declarations import Bound
from trunnion.basics.renamed_words import SETTINGS, add_note, deprecation_notes
from trunnion.basics.setting_declarations import offered
from trunnion.batch.plan_and_runner import Plan, Run, plan
from trunnion.scene.composition.data_with_source_lines import copy_of
from trunnion.scene.composition.deprecated_keys import replace_deprecated
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.file_format.yaml_writer import scene_to_dict
from trunnion.scene.library.model_folders import SCENE_FILE, bundled_names, model_folder
from trunnion.scene.overrides import apply
from trunnion.scene.scene_loader import load_scene, scene_from_dict, scene_from_text
from trunnion.service.basics.recently_used_cache import RecentItems
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.base_model_and_studies import (
    Number,
    Optimise,
    Path,
    PlainText,
    Refine,
    RequestModel,
    Sample,
    Tag,
    Text,
    study_request,
)
from trunnion.service.request_models.fit_request import Fit, fit_of_document, fit_of_request
from trunnion.simulation.settings.run_settings import describe_setting, settings_given, settings_read

END, SPACING = "simulation.until", "simulation.every"
HIGHER = "ask the operator for a higher limit"
JOBS = "POST /v1/jobs"
ONE_SOURCE = "give at most one of vary, cases, sample, optimise, refine and fit"
MOST_TEXT, MOST_VALUES = 250_000, 100_000
"""Limits of the number of characters and of values (including keys) in a scene. The limits are ten times the numbers of the largest
allowed scene."""


def _values(data: Any) -> int:
    """Number of keys and values in plain data."""
    todo, n = [data], 0
    while todo:
        value = todo.pop()
        n += 2 * len(value) if isinstance(value, dict) else len(value) if isinstance(value, list) else 0
        todo += value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return n


class SceneSource(RequestModel):
    """A scene. ``scene``: name of a bundled model, or the scene as JSON. ``scene_text``: the scene as YAML text."""

    scene: PlainText | dict[str, Any] | None = Field(None, description="Name of a bundled model, or a whole scene as JSON.")
    scene_text: Annotated[str, StringConstraints(max_length=MOST_TEXT)] | None = Field(
        None, description="A whole scene as YAML text."
    )
    overrides: dict[Path, Any] = Field(default_factory=dict, max_length=1000, description="Changes by dotted path.")


def with_settings(who: str) -> Any:
    """The request model of a scene with the run settings that the endpoint ``who`` offers. The schema states the bounds of the
    settings, but pydantic does not check them. The checks that all interfaces share enforce these bounds."""
    fields: dict[str, Any] = {}
    for s in offered(who):
        kind = PlainText if s.words else Annotated[float, WithJsonSchema(_schema(s.bound_at(who)))] | Text
        fields[s.name] = (kind | None, Field(None, description=describe_setting(s, who)))
    return create_model("WithSettings", __base__=SceneSource, **fields)


def _schema(bound: Bound) -> dict[str, Any]:
    """The JSON Schema of a number with this bound."""
    least = {"exclusiveMinimum" if bound.open else "minimum": bound.least} if isfinite(bound.least) else {}
    return {"type": "number"} | least | ({"maximum": bound.most} if isfinite(bound.most) else {})


class JobRequest(with_settings(JOBS)):  # type: ignore[misc]
    """A batch. The request has a scene, at most one of ``vary`` (grid), ``cases`` (list), ``sample``, ``optimise``, ``refine`` and
    ``fit``, and the results to store. Without any of these, the scene runs once."""

    vary: dict[Path, list[Number] | Number] | None = Field(
        None,
        max_length=100,
        description='Grid: values by path, as list or "first:last:count". All combinations run; the last path varies fastest.',
    )
    cases: list[dict[Path, Number]] | None = Field(None, min_length=1, description="List of cases: values by path for each case.")
    sample: Sample | None = None
    optimise: Optimise | None = None
    refine: Refine | None = None
    fit: Fit | None = None
    reductions: list[PlainText] = Field(
        default_factory=list,
        max_length=500,
        description="max:PATTERN, min:, mean:, final: of columns; first:EVENT, count:EVENT (stick, …, any); error:… of each.",
    )
    trajectories: list[PlainText] = Field(
        default_factory=list,
        max_length=100,
        description="Columns, or patterns of columns, that are stored over time for every case.",
    )
    spacing: float | None = Field(None, gt=0, description="Spacing of the stored rows, s; default: all rows.")
    certify: bool = Field(
        False,
        description="Whether to store the error of each reduction as `error:…`. If an error is missing, `error.why` is the reason.",
    )
    budget: float | None = Field(None, gt=0, description="Limit of the computing time of the job on all workers together, s.")
    label: PlainText = Field("", description="Label.")
    notify: PlainText = Field(
        "",
        description="Address to which the server reports the end of the job; it must begin with a --webhook address of the server.",
    )
    tags: list[Tag] = Field(default_factory=list, max_length=20, description="Tags.")


def scene_of(source: SceneSource, limits: Limits) -> Scene:
    """The scene of a request; SceneError with all problems. Only files of bundled models are opened."""
    given = [x for x in (source.scene, source.scene_text) if x is not None]
    if len(given) != 1:
        what = "no scene is given" if not given else "two scenes are given"
        raise SceneError([Problem("scene", what, "give scene (a model's name, or JSON) or scene_text (YAML)")])
    if isinstance(source.scene, dict) and (n := _values(source.scene)) > MOST_VALUES:
        raise SceneError([Problem("scene", f"the scene holds {n} values, more than {MOST_VALUES}", "remove unused values")])
    if isinstance(source.scene, str):
        if source.scene not in (names := bundled_names()):
            hint = f"one of {', '.join(names)}; or give the scene itself"
            raise SceneError([Problem("scene", f"there is no bundled model {source.scene!r}", hint)])
        scene = load_scene(model_folder(source.scene) / SCENE_FILE)
    elif source.scene is not None:
        scene = scene_from_dict(source.scene)
    else:
        scene = scene_from_text(source.scene_text or "", name="scene")
    if source.overrides:
        scene = apply(scene, source.overrides)
    if len(scene.bodies) > limits.bodies:
        what = f"{len(scene.bodies)} bodies are more than the {limits.bodies} allowed"
        raise SceneError([Problem("bodies", what, HIGHER)])
    return scene


def _budget_problems(budget: float | None, limits: Limits) -> list[Problem]:
    if budget is None or budget <= limits.job_seconds:
        return []
    return [Problem("budget", f"{budget:g} s is more than the {limits.job_seconds:g} s allowed", "a smaller budget")]


def _kept_row_problems(made: Plan, limits: Limits) -> list[Problem]:
    if made.series is None:
        return []
    until, every, _ = made.run.of(made.scene)
    spacing = made.series.every or every
    size = made.cases.count * (2 + len(made.series.columns)) * 8 * (until / spacing + 2 if spacing > 0.0 else limits.rows)
    if size <= limits.output_bytes:
        return []
    what = f"{size:.3g} bytes of rows are more than the {limits.output_bytes:.3g} allowed"
    return [Problem("trajectories", what, "request fewer columns, or a larger spacing")]


def _case_limit_problems(run: Run, scene: Scene, limits: Limits) -> list[Problem]:
    """Problems for violated limits of the time, steps and rows of a case."""
    until, every, _ = run.of(scene)
    asked = {"cpu_limit": run.cpu_limit or 0.0, "max_steps": run.max_steps or 0.0}
    problems = [
        Problem(n, f"{x:g} is more than the {getattr(limits, n):g} allowed to a case", f"request a smaller number, or {HIGHER}")
        for n, x in asked.items()
        if x > getattr(limits, n)
    ]
    rows = until / every if every > 0.0 else 0.0
    return problems + _long_run_problems("until", until, "every", rows, limits)


def _varied_limit_problems(made: Plan, limits: Limits) -> list[Problem]:
    """Problems for violated limits when end times or spacings are varied."""
    paths, run = made.cases.paths, made.run
    if not {END, SPACING} & set(paths):
        return []
    values = made.cases.values(0, made.cases.count)
    until, every, _ = run.of(made.scene)
    ends = values[:, paths.index(END)] if END in paths and run.until is None else np.array([until])
    spacings = values[:, paths.index(SPACING)] if SPACING in paths and run.every is None else np.array([every])
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.where(spacings > 0.0, ends / spacings, 0.0)
    return _long_run_problems(END, ends.max(), SPACING, rows.max(), limits)


def _long_run_problems(end: str, until: float, spacing: str, rows: float, limits: Limits) -> list[Problem]:
    """Problems for a case with a too late end time or too many rows. end, spacing: places of the two numbers in the request."""
    problems = []
    if until > limits.duration:
        what = f"{until:g} s is longer than the {limits.duration:g} s allowed"
        problems.append(Problem(end, what, f"request a shorter time, or {HIGHER}"))
    if rows > limits.rows:
        what = f"{rows:.3g} rows a case are more than the {limits.rows} allowed"
        problems.append(Problem(spacing, what, "a larger spacing"))
    return problems


CASE_FIELDS = {"vary", "cases", "sample", "label", "tags", "notify", "budget"}
"""The fields of a request that affect neither the structure of its plan nor the runs."""
_EARLIER: RecentItems[tuple[str, Limits | None], Plan] = RecentItems(4)
"""Plans of the last requests, by their other fields and by the limits that they were checked against."""


def _reusing(asked: Mapping[str, Any], limits: Limits | None, make: Callable[[Plan | None], Plan]) -> Plan:
    """The plan that ``make`` makes from the plan of an earlier request, which differed only in CASE_FIELDS, or from None. A request
    with deprecated words is never an earlier request, because it needs its notes each time."""
    key = json.dumps({k: v for k, v in asked.items() if k not in CASE_FIELDS}), limits
    with deprecation_notes() as notes:
        made = make(_EARLIER.get(key))
    for note in notes:
        add_note(note)
    if not notes and made.system is not None:
        _EARLIER.of(key, lambda: made)
    return made


def plan_of_request(request: JobRequest, limits: Limits) -> Plan:
    """The plan of a job's request. SceneError with all problems, including violated limits."""
    asked = request.model_dump()
    return _reusing(asked, limits, lambda earlier: _plan_of_request(request, asked, limits, earlier))


def _plan_of_request(request: JobRequest, asked: dict[str, Any], limits: Limits, earlier: Plan | None) -> Plan:
    """The plan of a job's request with the fields ``asked``. earlier: as for ``_reusing``."""
    scene = scene_of(request, limits) if earlier is None else earlier.scene
    values, problems = settings_read(JOBS, asked)
    problems += _budget_problems(request.budget, limits)
    if request.fit is not None:
        return fit_of_request(scene, asked, values["rtol"], problems, limits)
    most = {name: values[name] or getattr(limits, name) for name in ("cpu_limit", "max_steps")}
    run = replace(Run(**values), **most)
    problems += _case_limit_problems(run, scene, limits)
    try:
        made = _planned(scene, asked, run, limits.cases, earlier)
    except SceneError as e:
        told = {p.where for p in problems}
        raise SceneError([*problems, *(p for p in e.problems if p.where not in told)]) from None
    problems += _varied_limit_problems(made, limits)
    width = len(made.cases.paths) + len(made.reductions) + 6
    if made.cases.count * width * 8 > limits.output_bytes:
        what = f"{made.cases.count} cases of {width} columns are more than the {limits.output_bytes:.3g} bytes allowed"
        problems.append(Problem("reductions", what, "keep fewer reductions, or split the batch"))
    problems += _kept_row_problems(made, limits)
    raise_problems(problems)
    return made


def study_of_document(document: dict[str, Any]) -> Study | None:
    """The study in a stored document. None for a batch without a study."""
    wanted = study_request(current_settings(document))
    if wanted is None:
        return None
    document = current_document(document)
    with deprecation_notes():
        run = Run(**settings_given(JOBS, document))
        return make_study(scene_from_dict(document["scene"]), wanted, document["reductions"], run)[0]


def _planned(scene: Scene, asked: dict[str, Any], run: Run, most: int | None, earlier: Plan | None) -> Plan:
    """The plan for a scene and the other fields of a request. A study reports the parameter values of its cases later
    (``ReportedCases``). earlier: as for ``_reusing``."""
    if (wanted := study_request(asked)) is not None:
        ways = [asked[n] for n in ("vary", "cases", "sample", "optimise", "refine") if asked.get(n) is not None]
        wrong = [Problem("vary", "there is more than one source of cases", ONE_SOURCE)] if len(ways) > 1 else []
        for name, what in (("trajectories", "rows"), ("certify", "errors")):
            if asked.get(name):
                wrong.append(Problem(name, f"{what} of a study's cases are not stored", "fetch single cases"))
        if most is not None and wanted.cases > most:
            wrong.append(Problem("cases", f"{wanted.cases} cases are more than the {most} allowed", HIGHER))
        made, planned = make_study(scene, wanted, asked["reductions"], run, wrong)
        return with_case_values(made, planned, ReportedCases())
    sample, varied = asked["sample"] or {}, any(asked[n] is not None for n in ("vary", "cases", "sample"))
    return plan(
        scene,
        asked["vary"],
        asked["cases"] if varied else [{}],
        sample.get("ranges"),
        count=sample.get("count", 0),
        seed=sample.get("seed", 0),
        sampling=sample.get("method", "latin"),
        keep=asked["reductions"],
        run=run,
        trajectories=asked.get("trajectories") or (),
        most=most,
        earlier=earlier,
        **{n: asked[n] for n in ("spacing", "certify") if n in asked},
    )


def document_of(request: JobRequest, made: Plan) -> dict[str, Any]:
    """The request in its stored form. The full scene replaces the scene's name and changes, and the limits of a case are added. The
    meaning of the stored request is therefore fixed."""
    asked = request.model_dump(mode="json", exclude={"scene", "scene_text", "overrides", "notify"})
    return asked | {"scene": scene_to_dict(made.scene), "cpu_limit": made.run.cpu_limit, "max_steps": made.run.max_steps}


def current_document(document: dict[str, Any]) -> dict[str, Any]:
    """A stored document with deprecated words replaced by the current words. The user gets no notes about these words."""
    with deprecation_notes():
        scene = copy_of(document["scene"])
        replace_deprecated(scene, {})
    return current_settings(document) | {"scene": scene}


def current_settings(document: dict[str, Any]) -> dict[str, Any]:
    """A stored document with the current names of settings. Its scene is unchanged."""
    return {SETTINGS.get(name, name): value for name, value in document.items()}


def identity_of(request: JobRequest) -> str:
    """The digest of a request. The digest is computed with the deprecated names of fields, so that an idempotency key stays valid
    after an update of the server."""
    before = {new: old for old, new in SETTINGS.items()}
    asked = request.model_dump(mode="json", exclude={"optimise": {"revision"}, "refine": {"revision"}})
    return digest({before.get(name, name): value for name, value in asked.items()})


def plan_of_document(document: dict[str, Any]) -> Plan:
    """The plan of a job from its stored document."""
    document = current_document(document)

    def made(earlier: Plan | None) -> Plan:
        scene, values = earlier.scene if earlier else scene_from_dict(document["scene"]), settings_given(JOBS, document)
        if document.get("fit") is not None:
            return fit_of_document(scene, document, values["rtol"])
        return _planned(scene, document, Run(**values), None, earlier)

    with deprecation_notes():
        return _reusing(document, None, made)


def digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True, ensure_ascii=True).encode()).hexdigest()
