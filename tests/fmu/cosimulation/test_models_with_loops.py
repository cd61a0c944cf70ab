"""FMUs of the bundled models with loops give the engine's results."""

from __future__ import annotations

import pytest

from tests.fmu.cosimulation.test_models_without_loops import test_both_flavours_are_the_engine as open_models
from tests.fmu.fmpy_host import claim_equal_to_engine
from tests.fmu.scene_value_checks import claim_refuses_what_the_scene_refuses
from tests.sampling import sampled
from trunnion.scene import model_names

OPEN = open_models.pytestmark[0].args[1]
SOME = ("andrews", "caught_carriage", "crank_slider", "spatial_slider_crank")
"""Models with planar and spatial loops, one with latches, of which both flavours run by default."""


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", sampled((m for m in model_names() if m not in OPEN), SOME))
def test_both_flavours_are_the_engine(model: str) -> None:
    claim_equal_to_engine(model)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", [m for m in model_names() if m not in OPEN])
def test_it_refuses_what_the_scene_refuses(model: str) -> None:
    claim_refuses_what_the_scene_refuses(model)
