"""The command ``trunnion chart``, called as users call it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from trunnion.cli import main

FEW = ["--method", "rk8", "--rtol", "1e-6", "--until", "0.5", "--repeat", "1", "--samples", "10", "--no-fixed", "--no-solvers"]


def test_the_command_writes_four_files_and_names_the_fastest_settings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["chart", "simple_pendulum", "-o", str(tmp_path / "c"), *FEW]) == 0
    out = capsys.readouterr().out
    assert {p.name for p in (tmp_path / "c").iterdir()} == {"chart.svg", "chart.png", "chart.html", "chart.csv"}
    assert out.startswith("rk8, rtol 1e-06 to rtol 1e-06: error ")
    assert "fastest settings at each error" in out
    assert "whose results differ by" in out


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system does not tell which cores a process may use")
@pytest.mark.parametrize("after", ["a chart", "a mistake"])
def test_the_process_may_use_all_its_cores_afterwards(after: str, tmp_path: Path) -> None:
    allowed = os.sched_getaffinity(0)
    wrong = ["--outputs", "no.such"] if after == "a mistake" else []
    main(["chart", "simple_pendulum", "-o", str(tmp_path), *FEW, *wrong])
    assert os.sched_getaffinity(0) == allowed


def test_the_json_output_is_one_document(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["chart", "simple_pendulum", "-o", str(tmp_path), "--json", *FEW]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["exit_code"] == 0
    assert document["curves"][0]["points"][0]["outcome"] == "done"


def test_every_mistake_is_reported_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = ["chart", "simple_pendulum", "--method", "rk6", "--rtol", "7", "--norm", "least", "--outputs", "no.such"]
    assert main([*wrong, "--repeat", "0"]) == 2
    err = capsys.readouterr().err
    for word in ("-o:", "rk6", "--rtol", "least", "no.such", "--repeat"):
        assert word in err
