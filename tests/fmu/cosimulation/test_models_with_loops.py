"""FMUs of the bundled models with loops give the engine's results."""

from __future__ import annotations

import numpy as np
import pytest

from tests.default_case_selection import sampled
from tests.engine.mechanisms.rod_ladder import ladder, tension
from tests.fmu.cosimulation.test_models_without_loops import test_both_flavours_are_the_engine as open_models
from tests.fmu.engine_comparison import claim_equal_to_engine
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from tests.fmu.model_exchange.model_exchange_host import run_me
from tests.fmu.refused_parameter_values import claim_refuses_what_the_scene_refuses
from trunnion.fmu.scene_export import export
from trunnion.scene import model_names

OPEN = open_models.pytestmark[0].args[1]
SOME = ("andrews", "caught_carriage", "crank_slider", "spatial_slider_crank")
"""Models whose two flavours run by default: planar loops, spatial loops, and one model with latches."""


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", sampled((m for m in model_names() if m not in OPEN), SOME))
def test_both_flavours_are_the_engine(model: str) -> None:
    claim_equal_to_engine(model)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", [m for m in model_names() if m not in OPEN])
def test_the_fmu_refuses_values_that_the_scene_refuses(model: str) -> None:
    claim_refuses_what_the_scene_refuses(model)


def test_an_fmu_of_either_kind_gives_the_force_of_a_rod() -> None:
    """The test compares the force with a hand calculation. This force causes the friction of the guide. A parameter sets the length
    of the rod."""
    file = FOLDER / "ladder.fmu"
    export(ladder(), file, outputs="r0.axial_force", kind="both")
    host = Host(file, joints__r0__length=0.55)
    times = 0.1 * np.arange(1, 5)
    found = [row[0] for row in host.run(0.0, 4, 0.1, "r0.axial_force")]
    assert found == pytest.approx(tension(times, 0.3, 0.55), rel=1e-5)
    exchanged, _, complaints = run_me(file, 0.4, ["r0.axial_force"])
    assert complaints == []
    assert exchanged["r0.axial_force"] == pytest.approx(tension(exchanged["time"], 0.3), rel=1e-5)
