"""Bodies with inertia about one axis only: steady precession in closed form. Impossible rotations and impossible numbers are
refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.default_case_selection import sampled
from trunnion.basics.errors import SceneError
from trunnion.simulation.run import simulate

G = 9.81


def top(m: float, arm: float, inertia: float, tilt: float, rates: tuple[float, float]) -> dict[str, Any]:
    """A rotor at the end of a light arm. The arm tilts about y on a light yoke that turns about the vertical z.
    rates: precession of the yoke and spin of the rotor, rad/s."""

    def revolute(axis: str, inboard: Any, outboard: Any, q: float, qd: float) -> dict[str, Any]:
        return {"type": "revolute", "axis": axis, "inboard": inboard, "outboard": outboard, "start": {"q": q, "qd": qd}}

    light = {"mass": 0, "inertia": [0, 0, 0]}
    rotor = {"mass": m, "inertia": {"axial": inertia, "axis": "x"}}
    joints = {
        "precession": revolute("z", "ground", "yoke", 0.0, rates[0]),
        "tilt": revolute("y", "yoke", "arm", tilt, 0.0),
        "spin": revolute("x", {"body": "arm", "point": [arm, 0, 0]}, "rotor", 0.0, rates[1]),
    }
    scene = {"schema": 1, "gravity": [0, 0, -G], "bodies": {"yoke": light, "arm": light, "rotor": rotor}, "joints": joints}
    return scene | {"outputs": ["*.q[*]", "*.qd[*]", "energy.*"]}


@pytest.mark.parametrize("kernel", ["parts", pytest.param("compiled", marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", sampled(range(100), 10))
def test_a_heavy_rotor_precesses_steadily(seed: int, kernel: str) -> None:
    rng = np.random.default_rng(seed)
    m, arm, inertia = rng.uniform(0.5, 5), rng.uniform(0.1, 0.5), rng.uniform(0.01, 0.1)
    tilt, turn = rng.uniform(-1.0, 1.0), rng.uniform(0.5, 3.0)
    # The arm points down by β, so the spin axis has the vertical component −sin β. About the horizontal tilt axis,
    # J (spin − Ω sin β) Ω cos β − m a² Ω² sin β cos β balances m g a cos β.
    whole = (-m * G * arm + m * arm**2 * turn**2 * math.sin(tilt)) / (inertia * turn)
    spin = -whole + turn * math.sin(tilt)
    r = simulate(top(m, arm, inertia, tilt, (turn, spin)), until=1.0, every=0.25, rtol=1e-11, kernel=kernel)
    assert r.outcome.ok, r.outcome
    np.testing.assert_allclose(r["precession.q[1]"], turn * r.time, atol=1e-9)
    np.testing.assert_allclose(r["tilt.q[1]"], tilt, atol=1e-9)
    kinetic = 0.5 * m * (arm * turn * math.cos(tilt)) ** 2 + 0.5 * inertia * (spin - turn * math.sin(tilt)) ** 2
    np.testing.assert_allclose(r["energy.kinetic"], kinetic, rtol=1e-9)


def test_a_rotation_about_another_axis_without_inertia_is_refused_by_name() -> None:
    scene = top(1.0, 0.2, 0.05, 0.3, (1.0, 10.0))
    scene["bodies"]["rotor"]["inertia"]["axis"] = "y"
    assert simulate(scene, until=0.1).outcome.name == "no_inertia"


@pytest.mark.parametrize(("inertia", "where"), [({"axial": -1}, "axial"), ({"axial": 1, "axis": [0, 0, 0]}, "axis")])
def test_impossible_axial_inertias_are_reported(inertia: dict[str, Any], where: str) -> None:
    scene = top(1.0, 0.2, 0.05, 0.3, (1.0, 10.0))
    scene["bodies"]["rotor"]["inertia"] = inertia
    with pytest.raises(SceneError, match=rf"bodies\.rotor\.inertia\.{where}"):
        simulate(scene, until=0.1)
