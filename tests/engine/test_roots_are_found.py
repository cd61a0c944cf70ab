"""Before a run ends because friction had no answer, the answer has been sought from everywhere: what ends so has none, says a
search that shares no code."""

from __future__ import annotations

import numpy as np
import pytest

from engine.scene import model as sm
from engine.simulation import block as bl
from engine.simulation.run import Model
from tests.engine.states import ENERGY
from tests.reference.modes import answers
from tests.reference.streams import stream


def thick_pins(seed: int) -> sm.Scene:
    """Three skew bars in motion on pins so thick and rough that two of three such chains have no answer at all."""
    rng = stream("thick pins", seed)
    bodies, joints = {}, {}
    for k in range(3):
        length = float(rng.uniform(0.2, 0.6))
        points = {"a": (-length / 2, 0.01, 0.02), "b": (length / 2, float(rng.uniform(-0.1, 0.1)), 0.03)}
        bodies[f"b{k}"] = sm.Body(box=(length, 0.06, 0.04), density=2700.0, points=points)
        rub = sm.Friction(
            mu=float(rng.uniform(0.3, 1.2)), radius=float(rng.uniform(0.02, 0.25)), half_length=float(rng.uniform(0.05, 0.1))
        )
        start = sm.Start(float(rng.uniform(-3, 3)), float(rng.normal()))
        joints[f"j{k}"] = sm.Joint(
            "revolute", f"b{k - 1}.b" if k else "ground", f"b{k}.a", axis="xyz"[k], friction=rub, start=start
        )
    return sm.Scene(bodies, joints, gravity=(1.0, 2.0, -9.81), friction=sm.FrictionDefaults(law="coulomb"))


def begins(scene: sm.Scene) -> bool:
    """Whether the engine finds an answer at the start; what it takes for one obeys the laws."""
    model, settings = Model(scene, ENERGY), bl.Settings(rtol=1e-8)
    model.block.configure(settings)
    assert model.block.assemble() == 1
    code = model.begin(settings, 0.0, 1.0, 1.0, np.zeros(model.block.width))
    assert code != bl.OK or model.block.broken() == set()
    return code == bl.OK


def has_answer(scene: sm.Scene) -> bool:
    """What the other search says."""
    starts = {n: j.start for n, j in scene.joints.items() if j.start is not None}
    q, qd = ({n: np.array([getattr(s, what)]) for n, s in starts.items()} for what in ("q", "qd"))
    return bool(answers(scene, q, qd))


UNFOUND = (64, 129, 201)
"""Seeds whose root Newton's method finds neither from the last friction nor from none."""


@pytest.mark.parametrize("seed", [*range(8), *UNFOUND])
def test_a_chain_on_thick_pins_begins_when_it_has_an_answer(seed: int) -> None:
    scene = thick_pins(seed)
    assert begins(scene) == has_answer(scene)
