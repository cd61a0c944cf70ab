"""Some scenes and analyses do not support contacts that begin and end. They are refused by name."""

from __future__ import annotations

from typing import Any

import pytest

import trunnion
from tests.engine.unilateral.unilateral_scenes import body, box, corner, in_plane, scene
from trunnion.fmu.variables.model_exchange_states import refusals
from trunnion.simulation.run import Model

RESTS = ((0.5, 0.0, 0.0), (0.0, 0.0, 0.0))


def standing(**more: Any) -> dict[str, Any]:
    return {"fly": in_plane("rod", (0.5, 0, 0), (0, 0, 0)), "tip": corner("rod", (0.0, -0.5), 0.3, **more)}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joints": {"tip": {"type": "spherical", "curve": None}}}, "cannot open"),
        ({"simulation": {"method": "moreau"}}, "time stepping does not locate"),
        ({"joints": {"tip": {"friction": {"law": "viscous", "mu": 0.3}}}}, "impacts do not support the friction law viscous"),
        ({"joints": {"tip": {"cut": False}}}, "always cut"),
    ],
)
def test_a_scene_that_cannot_open_its_contacts_is_refused(changes: dict[str, Any], said: str) -> None:
    joints = standing()
    for name, change in changes.pop("joints", {}).items():
        joints[name] = {k: v for k, v in (joints[name] | change).items() if v is not None}
    with pytest.raises(trunnion.SceneError, match=said):
        scene({"rod": body(1.0, 0.1)}, joints, **changes)


def test_one_impact_law_holds_for_a_scene() -> None:
    joints = standing() | {"other": corner("rod", (0.1, -0.5), 0.3, impact_law="poisson")}
    with pytest.raises(trunnion.SceneError, match="same impact law"):
        scene({"rod": body(1.0, 0.1)}, joints)


@pytest.mark.parametrize(
    "analysis",
    [
        lambda s: trunnion.hold(s, bounds=True),
        lambda s: trunnion.simulate(s, overrides={"simulation.realtime.step": 1e-3}),
        lambda s: trunnion.inverse(s, [0.0, 1.0], {"fly.q[1]": [0.5, 0.5]}),
    ],
)
def test_analyses_without_impacts_are_refused(analysis: Any) -> None:
    with pytest.raises(trunnion.SceneError, match="begin and end are not supported"):
        analysis(box(0.3, 0.2, 0.5, 1.0, 0.1, *RESTS))


def swept(case: Any, **given: Any) -> Any:
    return trunnion.sweep(case, {"joints.left.friction.mu": [0.1]}, **given)


@pytest.mark.parametrize("run", [trunnion.simulate, swept])
def test_time_stepping_that_a_run_asks_for_is_refused(run: Any) -> None:
    with pytest.raises(trunnion.SceneError, match=r"^method: time stepping does not locate"):
        run(box(0.3, 0.2, 0.5, 1.0, 0.1, *RESTS), method="moreau")


def test_model_exchange_is_refused() -> None:
    assert any("unilateral" in p.where for p in refusals(Model(box(0.3, 0.2, 0.5, 1.0, 0.1, *RESTS))))


def test_a_start_inside_the_other_part_names_the_contact_its_depth_and_the_remedy() -> None:
    scene = box(0.3, 0.2, 0.5, 1.0, 0.1, (0.4, 0.0, 0.0), (0.0, 0.0, 0.0), starts="open")
    r = trunnion.simulate(scene, until=0.1)
    assert (r.outcome.name, r.outcome.joint) == ("penetration", "left")
    assert r.outcome.numbers["depth"] == pytest.approx(0.1, rel=1e-12)
    assert "leave out starts: open" in r.outcome.advice
    for of_rest in (trunnion.hold, trunnion.equilibrium):
        with pytest.raises(trunnion.SimulationError, match="leave out starts: open"):
            of_rest(scene)
