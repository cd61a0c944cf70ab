"""A run of each bundled model computes its reference numbers again."""

from __future__ import annotations

import json
from functools import lru_cache

import pytest

from tests.models.reference_file_reader import columns_of, evaluate, expected
from tests.models.reference_measures import measured
from trunnion.elements.friction import REGISTRY as AVAILABLE_LAWS
from trunnion.scene import load_scene
from trunnion.scene.library.model_folders import model_names
from trunnion.scene.overrides import apply
from trunnion.simulation.run import simulate

CASES = [(m, i) for m in model_names() for i, e in enumerate(expected(m)) if not e.compute]
IN_WORDS = [(m, i) for m in model_names() for i, e in enumerate(expected(m)) if e.compute]


@lru_cache(maxsize=64)
def row(model: str, changes: str, columns: tuple[str, ...], at: float) -> dict[str, float]:
    """Columns of a model at one time. The run ends at this time, so that no interpolation is needed."""
    scene = apply(load_scene(model), json.loads(changes))
    until = at if at > 0 else 1e-3
    result = simulate(scene, until=until, every=until, outputs=list(columns))
    assert result.outcome.ok, result.outcome
    return {n: float(result[n][-1 if at > 0 else 0]) for n in columns}


@pytest.mark.parametrize(("model", "index"), CASES, ids=[f"{m}-{i}" for m, i in CASES])
def test_model_reproduces_its_reference(model: str, index: int) -> None:
    e = expected(model)[index]
    if e.set.get("friction.law", "regularized") not in AVAILABLE_LAWS:
        pytest.skip(f"law {e.set['friction.law']} is not in this version")
    names = tuple(dict.fromkeys(c for x in expected(model) if x.value for c in columns_of(x.value)))
    values = row(model, json.dumps(dict(e.set)), names, e.at)
    got = evaluate(e.value, values.__getitem__)
    assert abs(got - e.expect) <= e.tolerance, f"{e.value} at {e.at}: {got!r}, expected {e.expect!r} ({e.origin})"


@pytest.mark.parametrize(("model", "index"), IN_WORDS, ids=[f"{m}-{i}" for m, i in IN_WORDS])
def test_model_reproduces_what_its_reference_says_in_words(model: str, index: int) -> None:
    e = expected(model)[index]
    if e.set.get("friction.law", "regularized") not in AVAILABLE_LAWS:
        pytest.skip(f"law {e.set['friction.law']} is not in this version")
    got = measured(e.compute, apply(load_scene(model), dict(e.set)))
    assert abs(got - e.expect) <= e.tolerance, f"{e.compute}: {got!r}, expected {e.expect!r} ({e.origin})"
