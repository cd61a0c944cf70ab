"""Random chains with friction at every joint, from rest and in motion, lose energy only to friction and do not chatter. A run ends
early only where no solution exists."""

from __future__ import annotations

import numpy as np
import pytest

from tests.default_case_selection import slow
from tests.reference.contact_and_friction.mode_enumeration_chains import answers
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import simulate

AXES = ("x", "y", "z")


def chain(seed: int, balls: float = 0.0) -> sm.Scene:
    """Two to four skew bars on revolutes with friction; some joints are balls."""
    rng = np.random.default_rng([seed, 5])
    count = int(rng.integers(2, 5))
    bodies: dict[str, sm.Body] = {}
    joints: dict[str, sm.Joint] = {}
    for k in range(count):
        length = float(rng.uniform(0.2, 0.6))
        points = {"a": (-length / 2, 0.0, 0.0), "b": (length / 2, float(rng.uniform(-0.1, 0.1)), 0.0)}
        bodies[f"b{k}"] = sm.Body(box=(length, 0.06, 0.04), density=2700.0, points=points)
        inboard = "ground" if k == 0 else f"b{k - 1}.b"
        mu, radius = float(rng.uniform(0.05, 0.8)), float(rng.uniform(0.005, 0.04))
        still = rng.random() < 0.3
        if rng.random() < balls:
            turn = tuple(float(v) for v in rng.normal(size=4))
            rates = (0.0, 0.0, 0.0) if still else tuple(float(v) for v in rng.normal(size=3))
            rub = sm.Friction(mu=mu, radius=radius)
            joints[f"j{k}"] = sm.Joint("spherical", inboard, f"b{k}.a", friction=rub, start=sm.Start(turn, rates))
            continue
        rub = sm.Friction(mu=mu, radius=radius, half_length=float(rng.uniform(0.05, 0.1)))
        start = sm.Start(float(rng.uniform(-3, 3)), 0.0 if still else float(rng.normal()))
        joints[f"j{k}"] = sm.Joint("revolute", inboard, f"b{k}.a", axis=str(rng.choice(AXES)), friction=rub, start=start)
    return sm.Scene(bodies, joints, f"chain_{seed}", gravity=(0.0, 0.0, -9.81))


COLUMNS = ("energy.*", "*.friction.work", "*.q[1]", "*.qd[1]", "*.qdd[1]")
"""Columns that the tests need. Contacts and reactions would take longer to compile than all other columns."""
INSTANT = 1e-8
"""Seconds beyond a run's end at which the search for solutions begins. A run ends 1e-12 s before two solutions meet and vanish, so
both still exist at its end. The interval without a solution may be as short as 1e-7 s. Seed 1144 ends at a pole of
the accelerations."""


def has_no_answer(scene: sm.Scene, until: float) -> None:
    """Check that a run ends with a named outcome, at the start or just beyond the last state. An independent search confirms that
    no combination of stick and slip satisfies Coulomb's law at this state."""
    r = simulate(scene, until=until, every=0, rtol=1e-7, outputs=COLUMNS)
    assert r.outcome.name in ("jammed", "inconsistent", "no_solution")
    # the outcome "inconsistent" may concern several joints
    assert r.outcome.joint in scene.joints or r.outcome.name == "inconsistent"
    q, qd = {}, {}
    for n, j in scene.joints.items():
        start = j.start
        assert start is not None
        place, rate = (r[f"{n}.q[1]"][-1], r[f"{n}.qd[1]"][-1]) if len(r.time) else (start.q, start.qd)
        moves = len(r.time) > 0 and abs(rate) > 1e-9
        more = INSTANT * r[f"{n}.qdd[1]"][-1] if moves else 0.0
        more = more if abs(more) < abs(rate) else 0.0  # near a pole, an acceleration is larger than any bound and is not checked
        q[n], qd[n] = np.array([place + INSTANT * rate * moves]), np.array([rate + more if moves or not len(r.time) else 0.0])
    if len(r.time):
        assert r.time[-1] == pytest.approx(r.outcome.time, abs=1e-9)
    assert answers(scene, q, qd) == []


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [1060, 1122, slow(1144), slow(1166), 1215])
def test_a_chain_whose_friction_has_no_solution_ends_there_with_that_outcome(seed: int) -> None:
    """The runs of the first two chains end at the start, the other runs during the motion. The last run ends where a joint has just
    come to rest."""
    has_no_answer(chain(seed), 3.0)


@pytest.mark.slow
def test_the_search_finds_a_solution_for_chains_whose_runs_finish() -> None:
    """The independent search finds solutions at the starts of chains whose runs finish."""
    for seed in (2, 3, 5):
        scene = chain(seed)
        starts = {n: j.start for n, j in scene.joints.items() if j.start is not None}
        q = {n: np.array([s.q]) for n, s in starts.items()}
        assert answers(scene, q, {n: np.array([s.qd]) for n, s in starts.items()})


def checked(seed: int, until: float, balls: float = 0.0) -> int:
    """Run a chain, check it against the claims, and return the number of its events."""
    scene = chain(seed, balls)
    r = simulate(scene, until=until, every=until / 50, rtol=1e-7, max_steps=100_000, outputs=COLUMNS)
    if not r.outcome.ok and not balls:
        has_no_answer(scene, until)
        return 0
    assert r.outcome.ok, (seed, r.outcome)
    size = max(np.abs(r["energy.kinetic"]).max(), 1e-3)
    # some thousand steps and hundreds of events have errors of 1e-7 each
    assert np.abs(r["energy.residual"]).max() <= 1e-4 * size, seed
    for name in r.scene.joints:
        work = r[f"{name}.friction.work"]
        assert np.diff(work).max() <= 1e-6 * size, (seed, name)
    assert len(r.events) <= 400 * until, seed
    return len(r.events)


@pytest.mark.parametrize("block", [0, 1, slow(2), slow(3)])
def test_random_chains_end_and_lose_energy_only_to_friction(block: int) -> None:
    assert sum(checked(seed, 2.0) for seed in range(6 * block, 6 * block + 6)) > 0


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("seed", [0, 13, 14, 19, 21, 22])
def test_random_chains_with_balls_end_and_lose_energy_only_to_friction(seed: int) -> None:
    checked(seed, 1.0, balls=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(20))
def test_many_random_chains_have_tens_of_thousands_of_events_and_no_failure(block: int) -> None:
    assert sum(checked(seed, 20.0) for seed in range(1000 + 20 * block, 1020 + 20 * block)) > 500
