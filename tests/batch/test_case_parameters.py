"""The table of parameters gives the numbers of many cases without building scenes. These numbers equal, bit for bit, the numbers of
separately built scenes."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tests.reference.scenes.random_scenes import random_tree
from trunnion.basics.errors import SceneError
from trunnion.batch.cases.grids_and_samples import sampled
from trunnion.batch.preparation import case_parameters
from trunnion.batch.preparation.case_parameters import Preparer, Run
from trunnion.batch.preparation.parameters_without_scene_builds import TRIED
from trunnion.scene import Scene, load_scene, model_names
from trunnion.scene.overrides import apply
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.system.construction.system_builder import build

SCENES = {name: name for name in model_names()} | {f"tree {k}": k for k in range(6)}
PAIR = {"joints.ball.friction.mu": (0.1, 0.6), "joints.ball.friction.radius": (0.01, 0.05)}


def scene_of(which: str) -> Scene:
    """A bundled model, or a random tree with friction, springs, dampers, stops, efforts, drives and loads in many joints."""
    given = SCENES[which]
    return load_scene(given) if isinstance(given, str) else random_tree(given, 4, friction=0.8, devices=0.9, drives=0.4).scene


@pytest.mark.default_cases(7)
@pytest.mark.parametrize("which", SCENES)
def test_a_number_the_table_places_acts_there_and_nowhere_else(which: str) -> None:
    scene = scene_of(which)
    start = build(scene)
    flat = Preparer(scene, (), Run())
    placed = [(p, at) for p in start.parameters.paths if (at := start.parameters.place(p)) is not None]
    assert placed or not any(j.friction for j in scene.joints.values())
    for path, at in placed:
        value = 1.01 * start.parameters.values[at] + (0.01 if start.parameters.values[at] >= 0.0 else -0.01)
        try:
            moved = build(apply(scene, {path: value}))
        except SceneError:
            continue  # the changed value would contradict another number of the scene
        assert flat._alike(moved), path
        changed = np.flatnonzero(flat._flat(moved) != flat.base)
        assert changed.tolist() == [at], path
        assert flat._flat(moved)[at] == value, path


def test_kinks_masses_and_points_are_not_placed() -> None:
    """Times of kinks, masses and points are used in more than one place: they also determine scales, the origins of bodies, and the
    ends of integration steps."""
    derived = set()
    for seed in range(8):
        places = build(random_tree(seed, 6, devices=1.0, drives=0.5).scene).parameters
        for path in places.paths:
            owner, last = path.partition(".")[0].partition("[")[0], path.rpartition(".")[2]
            if owner in ("bodies", "ground", "gravity") or last in ("begin", "duration"):
                assert places.place(path) is None, path
                derived.add(last)
    assert {"begin", "duration", "mass", "gravity[1]"} <= derived


def test_two_numbers_of_a_joint_are_prepared_without_building_scenes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Preparing a thousand cases must not build a thousand scenes."""
    scene = load_scene("spherical_pendulum")
    cases = sampled(scene, PAIR, 1000, seed=1)
    built = []
    monkeypatch.setattr(case_parameters, "build_with_starts", lambda s: built.append(s) or build(s))
    preparer = Preparer(scene, cases.paths, Run())
    (rows,), wrong = preparer.rows(cases.values(0, 1000))
    assert not wrong
    assert len(built) == 1
    for i in range(0, 1000, 97):
        one = build(apply(scene, cases.changes(i)))
        k = rows.index.tolist().index(i)
        assert rows.p[k].tobytes() == np.array(one.parameters.values).tobytes()
        assert rows.y[k].tobytes() == np.concatenate([one.numbers.q, one.numbers.v]).tobytes()


SHAPES = """
schema: 1
gravity: [0.1, -0.2, -9.81]
bodies:
  post: {cylinder: {radius: 0.03, length: 0.5}, density: 2700, center: [0, 0, 0.2], points: {end: [0, 0, 0.5]}}
  bob: {sphere: 0.07, mass: 1.3, center: [0.1, 0, 0], points: {end: [0.2, 0, 0]}}
  odd: {mass: 0.7, inertia: [0.01, 0.02, 0.015, 0.001, 0, 0], center: [0, 0.05, 0]}
joints:
  ball: {type: spherical, inboard: ground, outboard: post, start: {q: {axis: [1, 2, 0], angle: 0.4}}}
  hinge: {type: revolute, axis: y, inboard: post.end, outboard: bob}
  slide: {type: prismatic, axis: x, inboard: bob.end, outboard: odd}
"""
FOLLOW: dict[str, dict[str, tuple[float, float]]] = {
    "density": {"bodies.post.density": (900.0, 8000.0)},
    "masses": {"bodies.bob.mass": (0.3, 3.0), "bodies.odd.mass": (0.5, 1.0), "bodies.post.density": (900.0, 8000.0)},
    "gravity": {"gravity[1]": (-3.0, 3.0), "gravity[3]": (-12.0, -2.0)},
    "angle": {"joints.ball.start.q.angle": (-3.0, 3.0), "gravity[2]": (-1.0, -0.1)},
}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("which", FOLLOW)
def test_numbers_that_follow_a_formula_equal_those_of_built_scenes_bit_for_bit(which: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_from_dict(yaml.safe_load(SHAPES))
    cases = sampled(scene, FOLLOW[which], 300, seed=2)
    built = []
    monkeypatch.setattr(case_parameters, "build_with_starts", lambda s: built.append(s) or build(s))
    preparer = Preparer(scene, cases.paths, Run())
    (rows,), wrong = preparer.rows(cases.values(0, 300))
    assert not wrong
    assert len(built) <= 1 + TRIED * len(cases.paths)
    assert rows.index.tolist() == list(range(300))
    for i in range(0, 300, 23):
        (alone,), _ = Preparer(apply(scene, cases.changes(i)), (), Run()).rows(np.zeros((1, 0)))
        for name in ("p", "y", "given", "inputs", "settings"):
            assert getattr(rows, name)[i].tobytes() == getattr(alone, name)[0].tobytes(), name


def test_small_chunks_stop_building_scenes_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks of costly cases are small. The first chunks show which parameters the numbers change."""
    scene = load_scene("spherical_pendulum")
    cases = sampled(scene, {"bodies.pendulum.density": (900.0, 8000.0)}, 40 * 20, seed=2)
    built = []
    monkeypatch.setattr(case_parameters, "build_with_starts", lambda s: built.append(s) or build(s))
    preparer = Preparer(scene, cases.paths, Run())
    for start in range(0, cases.count, 20):
        (rows,), _ = preparer.rows(cases.values(start, start + 20))
        assert rows.p.shape[0] == 20
    assert len(built) < 1 + case_parameters.MANY + 20 + 12 * (TRIED + 1), "a few records of the largest and least value are tried"


def test_values_the_scene_refuses_are_reported_case_by_case() -> None:
    scene = load_scene("spherical_pendulum")
    values = np.column_stack([np.linspace(-0.1, 0.5, 61), np.linspace(0.01, 0.02, 61)])
    rows, wrong = Preparer(scene, tuple(PAIR), Run()).rows(values)
    assert set(wrong) == set(np.flatnonzero(values[:, 0] < 0.0).tolist())
    assert sorted(i for r in rows for i in r.index) == np.flatnonzero(values[:, 0] >= 0.0).tolist()
