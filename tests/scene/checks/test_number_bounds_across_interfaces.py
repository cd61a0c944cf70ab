"""If a scene refuses a number, every interface refuses the number, with the same message. All interfaces accept accepted
numbers.

This file states the limits of each kind of number by hand. The tests compare the interfaces for a number of every kind that occurs
in models."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import trunnion
from tests.scene.valid_scene import VALID
from trunnion.basics.errors import SceneError
from trunnion.batch.preparation.case_parameters import Preparer, Run
from trunnion.scene import load_scene, model_names, scene_from_dict, scene_from_text
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.overrides import apply, list_parameters, parse_assignment
from trunnion.scene.plain_data_changes import opened
from trunnion.scene.units.dimension_names import unit_of
from trunnion.scene.units.numbers_with_units import Quantity
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import SceneSource, scene_of

POSITIVE, NOT_NEGATIVE, NOT_ZERO = (-1.0, 0.0), (-1.0, -1e-300), (0.0,)
ANY: tuple[float, ...] = ()
BEYOND = {
    "bodies.arm.box[1]": POSITIVE, "bodies.arm.density": POSITIVE, "bodies.link.cylinder.radius": POSITIVE,
    "bodies.arm.center[1]": ANY, "gravity[3]": ANY,
    "friction.v_eps": POSITIVE, "joints.socket.friction.radius": POSITIVE, "joints.hinge.friction.mu": NOT_NEGATIVE,
    "joints.hinge.friction.half_length": POSITIVE, "joints.hinge.friction.viscosity": NOT_NEGATIVE,
    "joints.hinge.friction.v_stribeck": POSITIVE, "joints.hinge.friction.bristle_stiffness": POSITIVE,
    "joints.hinge.friction.bristle_damping": NOT_NEGATIVE, "joints.hinge.friction.thrust_radius": POSITIVE,
    "joints.hinge.spring.stiffness": NOT_NEGATIVE, "joints.hinge.spring.rest": ANY, "joints.hinge.damping": NOT_NEGATIVE,
    "joints.hinge.end_stops.stiffness": POSITIVE, "joints.hinge.end_stops.damping": NOT_NEGATIVE,
    "forces.rubber.stiffness": NOT_NEGATIVE, "forces.rubber.damping": NOT_NEGATIVE, "forces.rubber.length": NOT_NEGATIVE,
    "simulation.until": POSITIVE, "simulation.every": POSITIVE, "simulation.rtol": (0.0, 1e-15, 0.2, -1e-6),
}  # fmt: skip


def said(change: Any) -> list[str]:
    """The problems that a call raises, without hints; an empty result if the call succeeds."""
    try:
        change()
    except SceneError as e:
        return sorted(f"{p.where}: {p.what}" for p in e.problems)
    return []


def with_units(data: dict[str, Any]) -> dict[str, Any]:
    """The data in which parameters have units. Plain numbers in JSON would lose the units."""
    named = {n: f"{float(v)!r} {unit_of(v.dimension)}" if isinstance(v, Quantity) else v for n, v in data["parameters"].items()}
    return data | {"parameters": named}


def from_text(scene: trunnion.Scene, path: str, value: float) -> trunnion.Scene:
    """The scene read from the text of a file in which this number is replaced."""
    data = opened(scene)
    at = parse_path(path)
    assert at is not None
    owner = data
    for key in at[:-1]:
        owner = owner[key]
    old = owner[at[-1]]
    owner[at[-1]] = Quantity(value, old.dimension, "") if owner is data["parameters"] and isinstance(old, Quantity) else value
    return scene_from_text(json.dumps(with_units(data)), is_json=True)


def swept(scene: trunnion.Scene, path: str, value: float) -> None:
    """Prepare a sweep of one case with this value."""
    _, wrong = Preparer(scene, [path], Run()).rows(np.array([[value]]))
    if wrong:
        raise wrong[0]


def asked_of_the_service(scene: trunnion.Scene, path: str, value: float) -> None:
    """Request the scene with this value through REST."""
    scene_of(SceneSource(scene=with_units(opened(scene)), overrides={path: value}), Limits())


def reports_by_interface(scene: trunnion.Scene, path: str, value: float) -> dict[str, list[str]]:
    """The problems that each interface reports: override, option, file, sweep, request."""
    return {
        "override": said(lambda: apply(scene, {path: value})),
        "--set": said(lambda: apply(scene, dict([parse_assignment(f"{path}={value!r}")]))),
        "file": said(lambda: from_text(scene, path, value)),
        "sweep": said(lambda: swept(scene, path, value)),
        "service": said(lambda: asked_of_the_service(scene, path, value)),
    }


def kinds(scene: trunnion.Scene) -> dict[tuple[Any, ...], tuple[str, float]]:
    """One number of every kind, as (path, value). The key is the path without names."""
    out: dict[tuple[Any, ...], tuple[str, float]] = {}
    for p in list_parameters(scene):
        path = parse_path(p.path)
        assert path is not None
        named = (1, 3) if path[2:3] == ("points",) else (1,)
        shape = tuple(min(k, 1) if isinstance(k, int) else "*" if i in named else k for i, k in enumerate(path))
        kind = (*shape[:2], scene.joints[str(path[1])].type, *shape[2:]) if path[0] == "joints" else shape
        out.setdefault(kind, (p.path, p.value))
    return out


def small(scene: trunnion.Scene) -> bool:
    """True if the scene has so few numbers that building it takes little time."""
    return len(list_parameters(scene)) < 400


@cache
def new_kinds() -> dict[str, dict[tuple[Any, ...], tuple[str, float]]]:
    """One number of every kind that earlier models lack, by model. Small models come first, because more values of them are
    tested."""
    seen: set[tuple[Any, ...]] = set()
    out: dict[str, dict[tuple[Any, ...], tuple[str, float]]] = {}
    for model in sorted(model_names(), key=lambda m: not small(load_scene(m))):
        out[model] = {kind: at for kind, at in kinds(load_scene(model)).items() if kind not in seen}
        seen |= set(out[model])
    return out


def test_every_model_has_numbers_of_kinds_that_are_refused() -> None:
    """Each model has at least a mass or density, a size and settings of the run."""
    for model in model_names():
        scene = load_scene(model)
        met = [at for at in kinds(scene).values() if said(lambda s=scene, p=at[0]: apply(s, {p: -1.0}))]
        assert len(met) >= 4


def trials() -> list[Any]:
    """Every model with a negative number. Small models are also tested with zero and with half of the number, but by default only a
    third of them."""
    models = [m for m in model_names() if new_kinds()[m]]
    few = [m for m in models if small(load_scene(m))]
    more = [pytest.param(m, (0.0, 0.5), marks=() if i % 3 == 0 else pytest.mark.slow) for i, m in enumerate(few)]
    return [pytest.param(m, (-1.0,)) for m in models] + more


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("model", "trials"), trials())
def test_every_interface_reports_the_same_for_every_kind_of_number(model: str, trials: tuple[float, ...]) -> None:
    scene = load_scene(model)
    for path, value in new_kinds()[model].values():
        for trial in trials:
            found = reports_by_interface(scene, path, trial * value if trial > 0.0 else trial)
            assert len({tuple(f) for f in found.values()}) == 1, (path, trial, found)


@pytest.mark.default_cases(9)
@pytest.mark.parametrize("path", BEYOND)
def test_a_number_beyond_its_bound_is_refused_and_one_inside_is_not(path: str) -> None:
    scene = given_in_full(path)
    name = path.rsplit(".", 1)[-1]
    for value in BEYOND[path]:
        found = said(lambda value=value: apply(scene, {path: value}))
        assert len(found) == 1
        assert found[0].startswith(f"{path}: {name} must ")
        assert found[0].endswith(f"(it is {value:g})")
    inside = (1e-12, 1e-3) if path.endswith("rtol") else (1e-9, 0.3) if POSITIVE[1] in BEYOND[path] else (0.0, 0.3)
    for value in (*inside, *((-1.0,) if BEYOND[path] == ANY else ())):
        assert not said(lambda value=value: apply(scene, {path: value})), value


def given_in_full(path: str) -> trunnion.Scene:
    """The scene with one of everything. If the scene has no number at ``path``, one is added."""
    scene = scene_from_dict(VALID)
    known = {p.path for p in list_parameters(scene)}
    return scene if path in known else apply(scene, {path: 0.05})


def test_numbers_that_must_be_in_order_are_refused_on_the_wrong_side_of_each_other() -> None:
    scene = apply(scene_from_dict(VALID), {"joints.hinge.friction.mu": 0.3, "joints.hinge.friction.mu_static": 0.4})
    assert said(lambda: apply(scene, {"joints.hinge.friction.mu": 0.5})) == [
        "joints.hinge.friction.mu_static: mu_static must not be below mu: 0.4 is below 0.5"
    ]
    assert not said(lambda: apply(scene, {"joints.hinge.friction.mu": 0.4}))
    upper = float(scene.joints["hinge"].end_stops.upper)  # type: ignore[union-attr]
    for lower in (upper, upper + 1):
        assert said(lambda lower=lower: apply(scene, {"joints.hinge.end_stops.lower": lower})) == [
            f"joints.hinge.end_stops.upper: upper must be above lower: {upper:g} is not above {lower:g}"
        ]


def test_a_scene_made_in_python_is_checked_before_it_runs() -> None:
    scene = load_scene("simple_pendulum")
    name, body = next(iter(scene.bodies.items()))
    wrong = replace(scene, bodies={name: replace(body, mass=-1.0, density=None)})
    for door in (trunnion.simulate, trunnion.linearize, lambda s: trunnion.sweep(s, vary={"gravity[2]": [-9.0]})):
        assert f"bodies.{name}.mass: mass must not be negative (it is -1)" in said(lambda door=door: door(wrong))
