"""The command line shows requested errors in the summary, in figures and in the exit code."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import same_color

from trunnion.cli import main
from trunnion.plots import figure
from trunnion.plots.curves.error_bands import UNKNOWN
from trunnion.scene import models_dir
from trunnion.simulation.run import simulate

SHORT = ["simulate", "spherical_pendulum", "--until", "500 ms", "--every", "10 ms"]


def test_a_run_states_its_errors_and_fails_where_an_accuracy_is_not_met(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SHORT, "--certify", "--plot", str(tmp_path / "r.svg")]) == 0
    out = capsys.readouterr().out
    assert "errors of integration are stated to the end of the run" in out
    assert "± " in out
    assert "± " in (tmp_path / "r.svg").read_text(encoding="utf-8")
    assert main([*SHORT, "--accuracy", "1 mN"]) == 0
    assert "accuracy 1 mN: met" in capsys.readouterr().out
    assert main([*SHORT, "--accuracy", "1e-20 m", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["certainty"]["accuracy"] == {"asked": "1e-20 m", "met": False}
    assert main([*SHORT, "--accuracy", "1e-6", "--rtol", "1e-6"]) == 2


def test_figures_draw_a_band_about_each_curve_and_shade_where_nothing_is_promised() -> None:
    r = simulate(models_dir() / "stability" / "25_marginal.yaml", rtol=1e-4, certify=True, outputs="slide.q*")
    assert r.certainty is not None
    name = "slide.q[1]"
    panel = next(a for a in figure(r).axes if a.get_title(loc="left") == "Joint travels")
    band = panel.collections[0].get_paths()[0].vertices
    known = np.isfinite(r.certainty[name])
    assert band[:, 1].max() == pytest.approx((r[name] + r.certainty[name])[known].max())
    shaded = next(p for p in panel.patches if same_color(p.get_facecolor(), UNKNOWN))
    assert shaded.get_x() == pytest.approx(r.certainty.promise.until)
    assert "no error is stated from t =" in figure(r).texts[1].get_text()
    whole = figure(simulate("spherical_pendulum", until=0.5, certify=True))
    assert not whole.axes[0].patches
    plain = figure(simulate("spherical_pendulum", until=0.5))
    assert not plain.axes[0].collections
