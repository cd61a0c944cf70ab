"""Random trees and loops that rub in every joint, of any size: what is done has lost energy to friction alone and kept to every
cone, what ends by name had no way on, and every setting ends alike."""

from __future__ import annotations

import pytest

from engine.simulation.run import simulate
from tests.engine.widely import JAMS, SETTINGS, made, time_scale, way_on
from tests.reference.rubbing_scenes import rubbing

ENERGY, CONE = 1e-3, 1e-6
BLOCK = 50
"""Seeds of a block: in each, one may end differently at some setting (98 of 100 end alike)."""


def judged(kind: str, seed: int, settings=SETTINGS) -> tuple[list[str], bool]:
    """What is wrong with a random mechanism, and whether all settings ended alike."""
    case, wrong, ends = rubbing(kind, seed), [], set()
    for setting in settings:
        run = made(case, setting)
        outcome = run.result.outcome
        ends.add(outcome.name)
        at = f"{kind} {seed} {setting}: "
        if outcome.ok and not run.energy <= ENERGY:
            wrong.append(f"{at}energy off by {run.energy:.1e}")
        if outcome.ok and not run.cone <= CONE:
            wrong.append(f"{at}a cone broken by {run.cone:.1e}")
        if outcome.name in JAMS and (way := way_on(case, run.result)):
            wrong.append(f"{at}{outcome.name} at {outcome.time:g} s, where there is {way}")
    return wrong, len(ends) == 1


@pytest.mark.slow
@pytest.mark.parametrize("block", range(6))
@pytest.mark.parametrize("kind", ["tree", "loop"])
def test_three_hundred_random_mechanisms_obey_the_laws_at_five_settings(kind: str, block: int) -> None:
    found = [judged(kind, seed) for seed in range(BLOCK * block, BLOCK * (block + 1))]
    assert [w for wrong, _ in found for w in wrong] == []
    assert sum(not alike for _, alike in found) <= 1


@pytest.mark.parametrize(
    ("kind", "seed", "setting"),
    [
        ("tree", 38, ("rk5", 1e-5)),  # a ball that turns about its contact is carried across its cone when another pair stops
        (
            "loop",
            19,
            ("auto", 1e-4),
        ),  # a ball that closes a loop is slow for a moment, at a dead centre of its own, and does not stop
    ],
)
def test_some_random_mechanisms_obey_the_laws(kind: str, seed: int, setting: tuple[str, float]) -> None:
    assert judged(kind, seed, [setting]) == ([], True)


def test_a_point_of_a_step_without_an_answer_is_no_event() -> None:
    """The dense output of a step that is too long passes where friction has no answer. The step is made shorter; nothing jams
    there, and no root folds away."""
    case = rubbing("tree", 80)
    r = simulate(case.scene, until=0.6 * time_scale(case), every=0, method="rk5", rtol=1e-5, outputs=["energy.*"])
    assert r.outcome.ok
    assert [(e.kind, e.joint) for e in r.events] == [("reversal", "j2")]
