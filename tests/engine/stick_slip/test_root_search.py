"""If friction seems to have no solution, the engine searches from all starting points before it ends the run. An independent search
confirms that no solution exists."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.checks.right_hand_side import ENERGY
from tests.reference.contact_and_friction.mode_enumeration_chains import answers
from tests.reference.scenes.random_streams import stream
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl


def thick_pins(seed: int) -> sm.Scene:
    """Three skew bars in motion on thick, rough pins. Two of three such chains have no solution at all."""
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
    """True if the engine finds a solution at the start. This solution must obey the laws."""
    model, settings = Model(scene, ENERGY), bl.Settings(rtol=1e-8)
    model.block.configure(settings)
    assert model.block.assemble() == 1
    code = model.begin(settings, 0.0, 1.0, 1.0, np.zeros(model.block.width))
    assert code != bl.OK or model.block.broken() == set()
    return code == bl.OK


def has_answer(scene: sm.Scene) -> bool:
    """True if the independent search finds a solution."""
    starts = {n: j.start for n, j in scene.joints.items() if j.start is not None}
    q, qd = ({n: np.array([getattr(s, what)]) for n, s in starts.items()} for what in ("q", "qd"))
    return bool(answers(scene, q, qd))


UNFOUND = (64, 129, 201)
"""Seeds whose root Newton's method finds neither from the last friction nor from zero friction."""


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [*range(8), *UNFOUND])
def test_a_chain_on_thick_pins_begins_when_it_has_an_answer(seed: int) -> None:
    scene = thick_pins(seed)
    assert begins(scene) == has_answer(scene)
