"""A case of a sweep without an error has the reason that its single run gives. The table stores the reason as a number, which takes
almost no memory."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import trunnion
from trunnion.batch.plan_and_runner import Plan, Run, Runner, plan
from trunnion.batch.sweep_result import trajectory
from trunnion.batch.tables.case_table import WHY
from trunnion.cli import main
from trunnion.scene import load_scene, models_dir
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.simulation.results.error_statement import REASONS

MU, RTOL = "joints.guide.friction.mu", "simulation.rtol"


def grazing(beyond: float) -> Scene:
    """A block on a spring without friction, and an end stop slightly beyond its turning point."""
    slide = {
        "type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block", "spring": {"stiffness": 100.0},
        "end_stops": {"lower": -0.1 - beyond, "stiffness": 1000.0}, "start": {"q": 0.1},
    }  # fmt: skip
    block = {"mass": 1, "inertia": [1, 1, 1]}
    return scene_from_dict({"schema": 1, "gravity": [0, 0, 0], "bodies": {"block": block}, "joints": {"slide": slide}})


def rods() -> Scene:
    """Two rods without friction that fall from far above; their motion is chaotic."""
    rod = {"box": [1.0, 0.05, 0.05], "density": 1000.0, "points": {"a": [-0.5, 0, 0], "b": [0.5, 0, 0]}}
    one, two = ({"type": "revolute", "axis": "z", "start": {"q": q}} for q in (2.0, 1.0))
    one |= {"inboard": "ground", "outboard": "first.a"}
    joints = {"one": one, "two": two | {"inboard": "first.b", "outboard": "second.a"}}
    return scene_from_dict({"schema": 1, "gravity": [0, -9.81, 0], "bodies": {"first": rod, "second": rod}, "joints": joints})


def short_of_steps() -> Plan:
    """A run that ends just within its limit of steps. The tighter run has a limit 1.5 times as large, and does not end within this
    limit."""
    given: dict[str, Any] = {"vary": {RTOL: [1e-7]}, "keep": ["final:ball.qd[2]"], "certify": True}
    scene = load_scene("spherical_pendulum")
    needed = Runner(plan(scene, **given, run=Run(until=1.0))).chunk(0, 1)["steps"][0].as_py()
    return plan(scene, **given, run=Run(until=1.0, max_steps=1.1 * needed))


def of(scene: Scene, over: dict[str, list[float]], until: float | None = None) -> Plan:
    """The last coordinates of the cases of a scene, with their errors."""
    return plan(scene, over, keep=["final:*.q[*]"], run=Run(until=until), certify=True)


CASES = {
    "marginal": lambda: of(load_scene(models_dir() / "stability" / "25_marginal.yaml"), {RTOL: [1e-6]}),
    "events": lambda: of(grazing(1e-6), {RTOL: [1e-3]}, 2.0),
    "growth": lambda: of(rods(), {RTOL: [1e-6]}, 40.0),
    "outcome": short_of_steps,
    "start": lambda: of(load_scene("double_pendulum"), {MU: [0.6]}),
    "": lambda: of(grazing(1e-6), {RTOL: [1e-6]}, 2.0),
}


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("why", CASES)
def test_a_case_has_the_reason_of_its_own_run(why: str) -> None:
    asked = CASES[why]()
    table = Runner(asked).chunk(0, 1)
    alone = trajectory(asked, 0, ["*.q[*]"], certify=True).certainty
    assert alone is not None
    assert table[WHY].to_pylist() == [alone.promise.why] == [why]
    errors = [table[n][0].as_py() for n in table.column_names if n.startswith("error:")]
    assert all((e is None) == bool(why) for e in errors)


def test_every_reason_is_one_of_the_words_that_runs_say_and_none_is_reported_without_errors() -> None:
    r = trunnion.sweep("double_pendulum", {MU: "0.05:0.6:12", RTOL: [1e-3]}, reductions="final:guide.q[1]", until=4.0, certify=True)
    said = r.table[WHY].to_pylist()
    assert set(said) <= set(REASONS)
    assert {"marginal", "start"} <= set(said)
    assert r.missing_error_reasons == {w: said.count(w) for w in set(said) - {""}}
    stated = np.isfinite(r.table["error:final:guide.q[1]"].to_numpy())
    assert stated.tolist() == [not w for w in said]
    plain = trunnion.sweep("double_pendulum", {MU: [0.6]}, reductions="final:guide.q[1]", until=0.1)
    assert (WHY in plain.table.column_names, plain.missing_error_reasons) == (False, {})


def test_a_case_whose_numbers_are_refused_has_not_started() -> None:
    asked = plan(load_scene("spherical_pendulum"), {"bodies.pendulum.density": [-1.0, 7800.0]}, keep=["final:ball.qd[2]"],
                 run=Run(until=0.5), certify=True)  # fmt: skip
    assert Runner(asked).chunk(0, 2)[WHY].to_pylist() == ["start", ""]


def test_reasons_are_the_same_however_a_batch_is_cut() -> None:
    asked = of(load_scene("double_pendulum"), {MU: [0.05, 0.3, 0.45, 0.6], RTOL: [1e-3, 1e-7]}, 4.0)
    whole = Runner(asked).chunk(0, 8)
    assert len(set(whole[WHY].to_pylist())) > 2
    runner = Runner(asked)
    assert [row for a, b in ((0, 1), (1, 6), (6, 8)) for row in runner.chunk(a, b).to_pylist()] == whole.to_pylist()


def test_a_reason_is_kept_as_a_number_of_a_few_bits(tmp_path: Path) -> None:
    over: dict[str, Any] = {MU: "0.05:0.6:50", RTOL: [1e-3, 1e-4]}
    r = trunnion.sweep("double_pendulum", over, reductions="final:guide.q[1]", until=0.2, certify=True)
    file = pq.ParquetFile(r.save(tmp_path / "t.parquet"))
    about = file.metadata.row_group(0).column(file.schema_arrow.names.index(WHY))
    assert "RLE_DICTIONARY" in about.encodings
    assert about.total_compressed_size < 100 + len(r) / 2


def test_the_command_counts_cases_without_errors_by_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["sweep", "double_pendulum", "--vary", f"{MU}=0.1,0.6", "--reduce", "final:guide.q[1]", "--until", "0.2", "--certify"]
    assert main([*words, "-o", str(tmp_path / "t.csv")]) == 0
    assert f"no error estimates for 1 case (start): {REASONS['start']}" in capsys.readouterr().out
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
        assert [row[WHY] for row in csv.DictReader(file)] == ["", "start"]
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["errors_unstated"] == {"start": 1}
