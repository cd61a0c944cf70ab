"""Every run is audited. Correct runs stay within the limits of the audit. Defects are reported with time and joint. The lost energy
agrees with the bodies' positions and velocities."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.default_case_selection import slow
from tests.reference.mechanics.bodies_and_joint_frames import parts
from tests.reference.mechanics.rotation import matrix_from_quaternion
from tests.reference.scenes.brief_threshold_crossings import brief_pass
from trunnion import scene_from_dict
from trunnion.batch.sweep import sweep
from trunnion.runtime.abi import AuditLaw
from trunnion.scene import load_scene
from trunnion.simulation.execution.run_loop import OneRun
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface.simulation_block import DONE, Block, Settings

BODY = (("position", 3), ("velocity", 3), ("orientation", 4), ("angular_velocity", 3))


def bodies_energy(r: Result) -> np.ndarray:
    """Kinetic energy and energy of weight in every row, J. They are computed only from positions and velocities of the bodies, and
    from the masses and inertias of the reference."""
    total = np.zeros(len(r))
    for name, part in parts(r.scene).items():
        columns = (np.stack([r[f"{name}.{what}[{k + 1}]"] for k in range(n)], 1) for what, n in BODY)
        x, v, q, w = columns
        for i in range(len(r)):
            R = matrix_from_quaternion(q[i])
            total[i] += 0.5 * part.mass * v[i] @ v[i] + 0.5 * w[i] @ R @ part.inertia @ R.T @ w[i]
            total[i] -= part.mass * np.asarray(r.scene.gravity, float) @ x[i]
    return total


def disturbed(model: Model, until: float, at: float, change: Callable[[Block], None], **how) -> Result:
    """A run of a scene. At a given time, s, the test changes the block, and the run does not know of the change."""
    run = OneRun(model, until, until / 200, Settings(**how), None)
    stepping = model.block.advance

    def advance(target: float, steps: int, rows: np.ndarray) -> tuple[int, int]:
        if model.block.time < at:
            status, count = stepping(at, steps, rows)
            if status == DONE:
                change(model.block)
                return 1, count
            return status, count
        return stepping(target, steps, rows)

    model.block.advance = advance  # type: ignore[method-assign]
    return run.result()


# -- correct runs -----------------------------------------------------------------------------------------------------------------


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("outputs", ["*", "*.q[*]"], ids=["every column", "coordinates alone"])
@pytest.mark.parametrize("method", ["auto", "rk5", "rosenbrock"])
@pytest.mark.parametrize("name", ["spherical_pendulum", "crank_slider", "simple_pendulum"])
def test_the_audit_of_correct_runs_is_within_its_bounds(name: str, method: str, outputs: str) -> None:
    for rtol in (1e-4, 1e-8):
        r = simulate(name, rtol=rtol, method=method, outputs=outputs, every=0)
        assert r.outcome.ok
        assert (r.audit.verdict, r.audit.notes) == ("within", ())
        assert 0.0 <= r.audit.share <= 100 * rtol
        assert r.audit.energy is not None


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("outputs", ["*", "*.q[*]"], ids=["every column", "coordinates alone"])
def test_a_motion_that_is_given_slides_and_gives_energy_by_the_stiff_method_as_by_others(outputs: str) -> None:
    """The scene is not stiff, and nothing shortens a step. One step may cover the whole run, with joints at rest at both of its
    ends. Friction takes 7.1 J between these ends."""
    for rtol in (1e-4, 1e-8):
        shown = [outputs, "energy.dissipated"]
        r, other = (simulate("robot_arm", rtol=rtol, method=m, outputs=shown) for m in ("rosenbrock", "rk8"))
        assert (r.outcome.name, r.audit.verdict, r.audit.notes) == ("done", "within", ())
        assert r.audit.share <= 100 * rtol
        assert [(e.kind, e.joint) for e in r.events] == [(e.kind, e.joint) for e in other.events]
        assert r["energy.dissipated"][-1] == pytest.approx(other["energy.dissipated"][-1], rel=10 * rtol)


@pytest.mark.parametrize(("seed", "rtol"), [slow((5329, 1e-7)), (5586, 1e-5)])
def test_events_inside_stiff_steps_lose_no_energy(seed: int, rtol: float) -> None:
    """Drives give nearly all energy. The power of the drives may be odd about the middle of a step. Simpson's rule then uses a
    wrong parabola up to an event inside the step."""
    case = brief_pass(seed)
    r = simulate(scene_from_dict(case.scene), until=case.until, every=case.until, method="rosenbrock", rtol=rtol)
    assert r.events
    assert (r.outcome.name, r.audit.verdict) == ("done", "within")
    assert r.audit.share <= rtol


@pytest.mark.parametrize("name", ["simple_pendulum", "crank_slider_free", "spatial_slider_crank"])
def test_steps_of_impulses_are_judged_by_their_own_tolerance(name: str) -> None:
    """The loss is at most 15 × rtol of the energy converted. This limit was measured in twelve bundled models at 1e-3 … 1e-6."""
    for rtol in (1e-4, 1e-6):
        r = simulate(name, until=1.0, rtol=rtol, method="moreau", outputs="*.q[*]", every=1.0)
        assert (r.outcome.ok, r.audit.verdict, r.audit.tolerance) == (True, "within", rtol)
        assert r.audit.share <= 30 * rtol


def test_a_driven_joint_that_starts_from_rest_is_no_error() -> None:
    """The motion of the joint is prescribed. Therefore friction does not hold the joint, and the audit finds no imbalance."""
    assert simulate("robot_arm", until=0.01).audit.notes == ()


@pytest.mark.parametrize("mu", [0.0, 1e-300])
def test_friction_that_is_none_is_beyond_no_law(mu: float) -> None:
    """The law gives no friction. The residual of its equations is round-off, and the limit is zero."""
    run = simulate("spherical_pendulum", until=1.0, every=0.1, overrides={"joints.ball.friction.mu": mu})
    assert run.audit.verdict == "within"
    assert run.audit.notes == ()


def test_creep_at_rest_and_bristles_that_give_back_are_no_errors() -> None:
    bristles = {"joints.ball.friction.bristle_stiffness": 1e3, "joints.ball.friction.bristle_damping": 0.03}
    for law in ({"friction.law": "regularized"}, {"friction.law": "lugre", **bristles}):
        r = simulate("spherical_pendulum", overrides=law, until=12.0, outputs="ball.q[*]")
        assert (r.outcome.name, r.audit.verdict) == ("done", "within")


# -- runs with defects ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", [{"rtol": 0.1}, {"method": "rk5", "step": 1.0}], ids=["rtol", "fixed step"])
def test_steps_far_too_long_are_inaccurate_by_as_much_as_the_bodies_say(how: dict) -> None:
    r = simulate("simple_pendulum", until=10.0, every=0, **how)
    assert (r.outcome.name, r.audit.verdict) == ("inaccurate", "inaccurate")
    energy = bodies_energy(r)
    then = int(np.abs(r.time - r.audit.energy_time).argmin())
    assert r.audit.energy == pytest.approx(energy[then] - energy[0], rel=1e-9)
    assert abs(r.audit.energy) > 0.1 * np.ptp(energy)
    assert r.outcome.numbers["energy"] == r.audit.energy
    assert len(r) == r.stats.steps + 1
    assert any(n.startswith("audit at t = ") and "J" in n for n in r.notes)


@pytest.mark.parametrize(("method", "outputs"), [("auto", "*"), ("rosenbrock", " ".join(f"*.{what}[*]" for what, _ in BODY))])
def test_energy_that_appears_at_once_is_reported_with_its_time(method: str, outputs: str) -> None:
    """At 3 s the test multiplies all rates by 1.2, so that 0.44 of the kinetic energy appears. If no column needs works, the audit
    uses Simpson's rule over the steps of the stiff method."""
    model = Model(load_scene("crank_slider_free"), outputs.split())

    def push(block: Block) -> None:
        n = model.system.nq
        block.y[n : n + model.system.nv] *= 1.2

    r = disturbed(model, 6.0, 3.0, push, method=method)
    energy = bodies_energy(r)
    gained = np.median(energy[r.time > 3.1]) - np.median(energy[r.time < 2.9])
    assert (r.outcome.name, r.audit.verdict) == ("inaccurate", "inaccurate")
    assert r.audit.energy == pytest.approx(gained, rel=1e-3)
    assert 3.0 <= r.outcome.time <= 3.2


def test_energy_that_steps_of_impulses_gain_is_reported_at_their_tolerance() -> None:
    """At 0.5 s the test multiplies all rates by 1.02. The added 4 % of the kinetic energy are 40,000 × rtol."""
    model = Model(load_scene("crank_slider_free"), ["*.q[*]"])

    def push(block: Block) -> None:
        n = model.system.nq
        block.y[n : n + model.system.nv] *= 1.02

    r = disturbed(model, 1.0, 0.5, push, method="moreau", rtol=1e-6)
    assert r.audit.verdict == "inaccurate"
    assert 0.5 <= r.outcome.time <= 0.6


def test_friction_that_drives_is_reported_with_its_joint() -> None:
    """At 0.1 s the test makes the coefficient of friction negative."""
    model = Model(load_scene("spherical_pendulum"), ["*.q[*]"])
    place = int(np.flatnonzero(model.block.parameters == 0.6)[0])

    def turn(block: Block) -> None:
        block.parameters[place] = -0.6
        block.prepare()

    r = disturbed(model, 0.3, 0.1, turn)
    drives = r.audit.laws[AuditLaw.DRIVES.name.lower()]
    assert r.audit.verdict == "note"
    assert drives.joint == "ball"
    assert drives.size > 0.1
    assert drives.time is not None
    assert 0.1 <= drives.time <= 0.3
    assert any("joint ball: friction adds energy" in n for n in r.notes)


# -- all interfaces ---------------------------------------------------------------------------------------------------------------


def test_a_sweep_says_of_each_case_what_its_own_run_says() -> None:
    over = {"joints.ball.friction.mu": [0.0, 0.3]}
    table = sweep("spherical_pendulum", vary=over, reductions=["final:ball.qd[2]"], until=10.0, rtol=0.1).table
    for k, mu in enumerate((0.0, 0.3)):
        r = simulate("spherical_pendulum", until=10.0, rtol=0.1, outputs="ball.qd[2]", overrides={"joints.ball.friction.mu": mu})
        assert table["outcome"][k].as_py() == r.outcome.name
        assert table["audit"][k].as_py() == r.audit.verdict
        assert table["audit.energy"][k].as_py() == r.audit.share
        assert table["audit.note"][k].as_py() == "; ".join(r.audit.notes)
    assert "inaccurate" in table["outcome"].to_pylist()
