"""Only one place in the code determines the body, point, axes and friction law of a joint side or a load."""

from pathlib import Path

import pytest

from trunnion.scene import Scene
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.queries.body_references import axes_of, body_of, named_point, point_of

BODY = sm.Body(mass=1.0, inertia=(1.0, 1.0, 1.0), points={"tip": (1.0, 2.0, 3.0)})
SCENE = Scene({"arm": BODY}, {}, ground=sm.Ground({"wall": (4.0, 5.0, 6.0)}))
PLACES = {
    "a body": ("arm", "arm", "", (0.0, 0.0, 0.0)),
    "a point of a body": ("arm.tip", "arm", "tip", (1.0, 2.0, 3.0)),
    "a point of the ground": ("ground.wall", "ground", "wall", (4.0, 5.0, 6.0)),
    "a side": (sm.Side("arm"), "arm", "", (0.0, 0.0, 0.0)),
    "a side with a named point": (sm.Side("arm", "tip"), "arm", "tip", (1.0, 2.0, 3.0)),
    "a side with a place": (sm.Side("arm", (7, 8, 9)), "arm", "", (7.0, 8.0, 9.0)),
}


@pytest.mark.parametrize("what", PLACES)
def test_a_side_of_a_joint_is_a_body_and_its_point(what):
    side, body, name, place = PLACES[what]
    assert (body_of(side), named_point(side), point_of(SCENE, side)) == (body, name, (body, place))


def test_a_side_has_its_own_axes_or_the_joints():
    j = sm.Joint("revolute", "ground", sm.Side("arm", axis="y"), axis="x", reference="z")
    assert axes_of(j, j.inboard) == ("x", "z")
    assert axes_of(j, j.outboard) == ("y", "z")


def test_a_joint_has_its_own_law_or_the_scenes():
    scene = Scene({}, {}, friction=sm.FrictionDefaults(law="stribeck", normal_force="adams"))
    plain, own = sm.Friction(), sm.Friction(law="viscous", normal_force="exact")
    assert (scene.law_of(plain), scene.normal_force_of(plain)) == ("stribeck", "adams")
    assert (scene.law_of(own), scene.normal_force_of(own)) == ("viscous", "exact")


def test_nothing_else_chooses_between_a_joints_law_and_the_scenes():
    root = Path(__file__).resolve().parents[3]
    files = [f for top in ("engine", "fmu", "service") for f in (root / top).rglob("*.py")]
    assert not [f for f in files if "or scene.friction." in f.read_text(encoding="utf-8")]
