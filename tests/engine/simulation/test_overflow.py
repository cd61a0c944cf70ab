"""Finished runs have no rows with NaN or infinity. Overflows are named, and rows before an overflow are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion


def swing(mass: float, **more: Any) -> dict[str, Any]:
    """A body of this mass on a pivot with friction."""
    pivot = {"type": "revolute", "axis": "y", "inboard": "ground", "outboard": "b.p"}
    rubs = {"friction": {"mu": 0.2, "radius": 0.01, "half_length": 0.02}}
    body = {"mass": mass, "inertia": [1, 1, 1], "points": {"p": [-1, 0, 0]}}
    return {"bodies": {"b": body}, "joints": {"j": {**pivot, **rubs}}, **more}


@pytest.mark.parametrize("mass", [1e155, 1e300])
def test_forces_out_of_the_range_of_numbers_end_the_run_by_name(mass: float) -> None:
    r = trunnion.simulate(swing(mass), until="10 ms", every="1 ms")
    assert r.outcome.name == "not_finite"
    assert r.outcome.joint == "j"
    assert np.isfinite(r.data).all()


def pushed(force: float) -> dict[str, Any]:
    """The body on its pivot, under a force that grows to this value in a second."""
    push = {"type": "force", "on": "b", "force": [{"ramp": {"start": 0, "end": force, "duration": 1, "begin": 0.01}}, 0, 0]}
    return swing(1.0, forces={"push": push})


@pytest.mark.parametrize("bounds", [{}, {"evaluations": 1, "iterations": 1, "events": 0}], ids=["exact", "relaxed"])
@pytest.mark.parametrize("force", [1e100, 1e200])
def test_bounded_steps_end_at_an_overflow_and_keep_only_finite_rows(force: float, bounds: dict[str, int]) -> None:
    """The test runs exact steps, and steps whose friction comes from sweeps. A run within the range of numbers continues."""
    asked = {"simulation.realtime": {"step": 1e-3, **bounds}}
    r = trunnion.simulate(pushed(force), until=0.1, every=0.001, overrides=asked, kernel="parts")
    assert r.outcome.name == ("not_finite" if bounds or force > 1e150 else "done")
    assert len(r.time) > 10
    assert np.isfinite(r.data).all()


def test_rows_before_an_overflow_are_kept() -> None:
    scene = pushed(1e200)
    r = trunnion.simulate(scene, until=0.1, every=0.001, outputs=["j.contact*", "j.q*"], max_steps=20_000)
    assert not r.outcome.ok
    assert len(r.time) > 5
    assert np.isfinite(r.data).all()


def test_an_overflow_is_the_outcome_of_its_case_in_a_sweep() -> None:
    over = {"bodies.b.mass": [1.0, 1e300]}
    table = trunnion.sweep(swing(1.0), vary=over, until="10 ms", reductions="max:j.contact[1].normal_force").table
    assert table.column("outcome").to_pylist() == ["done", "not_finite"]


def test_a_heavy_body_within_the_range_of_numbers_runs(tmp_path: Path) -> None:
    r = trunnion.simulate(swing(1e120), until="10 ms", every="1 ms")
    assert r.outcome.ok
    assert np.isfinite(r.data).all()
