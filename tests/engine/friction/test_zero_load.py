"""A joint with friction and without load stays at rest while no friction is needed. A load that needs no friction does not change
this."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion.elements.contact import REGISTRY as CONTACTS
from trunnion.elements.contact.contact_element import OVERLAP
from trunnion.elements.joints import REGISTRY
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

SIZES = {"radius": 0.01, "flank_angle": 0.26}
"""Sizes of contacts. All sizes that are not listed are LENGTH."""
LENGTH = 0.02
TYPES = tuple(k.name for k in REGISTRY.values() if k.friction and not k.bodiless)
AXES = {
    "spherical": {}, "point_on_plane": {"axis": "y"},
    "universal": {"inboard": sm.Side("ground", axis="x"), "outboard": sm.Side("hub", axis="y")},
}  # fmt: skip


def hub(kind: str, law: str, push: sm.Load) -> sm.Scene:
    """A body at rest whose joint passes through its middle."""
    needed = [s.name for s in CONTACTS[REGISTRY[kind].friction].sizes if s.needed and s.ends != OVERLAP]
    numbers = {name: SIZES.get(name, LENGTH) for name in needed}
    numbers |= {"v_stribeck": 1e-3, "mu_static": 0.2} if law == "stribeck" else {}
    axes = AXES.get(kind, {"axis": "x"}) | ({"pitch": 0.004} if REGISTRY[kind].pitched else {})
    parts = {"inboard": "ground", "outboard": "hub"} | axes
    joint = sm.Joint(kind, **parts, friction=sm.Friction(mu=0.05, law=law, **numbers))
    body = sm.Body(mass=2.0, inertia=(0.01, 0.01, 0.01))
    pushed = {"push": sm.Force("force", "hub", (0.0, push, 0.0))}
    return sm.Scene({"hub": body}, {"joint": joint}, "hub", gravity=(0.0, 0.0, 0.0), forces=pushed)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("law", ["coulomb", "stribeck"])
@pytest.mark.parametrize("kind", TYPES)
def test_a_joint_at_rest_without_load_stays_at_rest_under_a_load_that_cannot_move_it(kind: str, law: str) -> None:
    wave = sm.Signal(harmonic=sm.Harmonic(30.0, 3.0))
    for push in (0.0, wave):  # a push through the middle, across the axis, cannot move the hub
        r = simulate(hub(kind, law, push), until=0.1, every=0.01)
        assert r.outcome.ok, (kind, law, push, str(r.outcome))
        assert len(r) == 11
        rates = np.array([r[c] for c in r.matching("joint.qd[*]")])
        assert np.abs(rates).max() == 0.0
