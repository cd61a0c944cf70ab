"""Results of many cases are stored with estimates of their global errors. The test compares results with a run at a much smaller
tolerance. In nine of ten values, the difference is at most the estimate. The difference never exceeds four times the estimate. The
table states no error where the decision between stick and slip is not certain."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import trunnion
from trunnion.basics.errors import SceneError
from trunnion.batch.plan_and_runner import Run, Runner, plan
from trunnion.cli import main
from trunnion.scene import load_scene, models_dir
from trunnion.service.basics.server_settings import Limits
from trunnion.service.request_models.job_request import JobRequest, document_of, plan_of_document, plan_of_request

MU = "joints.ball.friction.mu"
KEEP = [
    "max:ball.contact[1].normal_force", "min:ball.contact[1].angle", "final:ball.qd[2]", "final:ball.q[*]", "mean:energy.kinetic",
    "first:reversal", "count:any",
]  # fmt: skip
SMOOTH = ["final:bob.position[*]", "max:bob.velocity[2]"]
OVER = {MU: "0.1:0.6:8"}
TIGHT = 1e-12


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("rtol", [1e-5, 1e-7])
@pytest.mark.parametrize("kernel", ["parts", "lanes"])
def test_the_error_of_a_result_covers_its_distance_from_a_far_tighter_run(kernel: str, rtol: float) -> None:
    over: dict = OVER if kernel == "parts" else {"joints.pivot.start.q": "0.3:2.5:8"}
    name, keep = ("spherical_pendulum", KEEP) if kernel == "parts" else ("simple_pendulum", SMOOTH)
    given: dict = {"reductions": keep, "until": 3.0, "rtol": rtol, "kernel": kernel}
    plain, r = trunnion.sweep(name, over, **given), trunnion.sweep(name, over, certify=True, **given)
    exact = trunnion.sweep(name, over, **given | {"rtol": TIGHT})
    kept = [n for n in plain.table.column_names if ":" in n]
    assert r.table.select(plain.table.column_names).equals(plain.table)
    assert [n for n in r.table.column_names if n.startswith("error:")] == [f"error:{n}" for n in kept]
    inside: list[bool] = []
    for n in kept:
        stated, true = r.table[f"error:{n}"].to_numpy(), np.abs(plain.table[n].to_numpy() - exact.table[n].to_numpy())
        assert np.isfinite(stated).all()
        assert np.all(true <= 4.0 * stated), n
        inside += (true <= stated).tolist()
        assert r.table.schema.field(f"error:{n}").metadata[b"unit"] == plain.table.schema.field(n).metadata[b"unit"]
    assert np.mean(inside) >= 0.9


def test_an_error_can_be_requested_alone_and_by_patterns() -> None:
    chosen = plan(load_scene("spherical_pendulum"), OVER, keep=["error:final:ball.qd[*]", "count:stick"], run=Run(until=1.0))
    assert [r.name for r in chosen.reductions] == [*(f"error:final:ball.qd[{i}]" for i in (1, 2, 3)), "count:stick"]
    with pytest.raises(SceneError) as e:
        plan(load_scene("spherical_pendulum"), OVER, keep=["error:ball.qd[1]", "error:max:nothing", "error:error:max:ball.qd[1]"])
    assert [p.what.split(" ", 1)[1] for p in e.value.problems] == ["is not a reduction", "matches no column", "is not a reduction"]


def test_no_error_is_stated_where_a_decision_may_fall_otherwise_or_a_case_does_not_end() -> None:
    """The block stops where spring force and static friction differ by one part in a million."""
    marginal = load_scene(models_dir() / "stability" / "25_marginal.yaml")
    r = trunnion.sweep(marginal, {"simulation.rtol": [1e-6, 1e-9]}, reductions="final:slide.q[1]", certify=True)
    stated = r.table["error:final:slide.q[1]"].to_numpy()
    assert np.isnan(stated[0])
    assert stated[1] < 1e-6
    given: dict = {"reductions": "final:ball.qd[2]", "until": 0.5, "certify": True}
    refused = trunnion.sweep("spherical_pendulum", {"bodies.pendulum.density": [-1.0, 7800.0]}, **given)
    assert np.isnan(refused.table["error:final:ball.qd[2]"].to_numpy()).tolist() == [True, False]


def test_how_a_certified_batch_is_cut_changes_nothing() -> None:
    chosen = plan(load_scene("spherical_pendulum"), OVER, keep=KEEP[:3], run=Run(until=1.0), certify=True)
    whole, runner = Runner(chosen).chunk(0, 8), Runner(chosen)
    assert [x for a, b in ((0, 3), (3, 8)) for x in runner.chunk(a, b).to_pylist()] == whole.to_pylist()
    told: list[int] = []
    runner.chunk(0, 8, lambda done: told.append(done) or True)
    assert told == sorted(told)
    assert max(told, default=0) <= 8


def test_rows_are_kept_of_the_run_itself() -> None:
    given: dict = {"reductions": "final:ball.qd[2]", "until": 1.0, "trajectories": ["ball.qd[2]"], "spacing": 0.1}
    plain, r = (trunnion.sweep("spherical_pendulum", OVER, certify=c, **given) for c in (False, True))
    assert r.trajectories is not None
    assert r.trajectories.equals(plain.trajectories)


def test_the_command_and_a_request_ask_for_errors_as_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "t.csv"
    words = ["sweep", "spherical_pendulum", "--vary", f"{MU}=0.2,0.4", "--reduce", "final:ball.qd[2]", "--until", "1"]
    assert main([*words, "--certify", "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["problems"] == []
    assert "error:final:ball.qd[2]" in out.read_text(encoding="utf-8").splitlines()[0]
    asked = JobRequest(scene="spherical_pendulum", vary=OVER, reductions=["final:ball.qd[2]"], certify=True)
    made = plan_of_request(asked, Limits())
    again = plan_of_document(document_of(asked, made))
    assert [r.name for r in made.reductions] == [r.name for r in again.reductions] == ["final:ball.qd[2]", "error:final:ball.qd[2]"]
    best = {"bounds": {MU: [0.1, 0.5]}, "minimise": "final:ball.qd[2]"}
    with pytest.raises(SceneError, match="errors of a study's cases are not stored"):
        plan_of_request(JobRequest(scene="spherical_pendulum", optimise=best, certify=True), Limits())
