"""The list of events is the same for all methods and tolerances."""

from __future__ import annotations

import pytest

from engine.simulation.result import Result
from engine.simulation.run import simulate
from tests.engine.event_lists import difference
from tests.engine.widely import time_scale
from tests.reference.rubbing_scenes import rubbing


def run(seed: int, method: str, rtol: float) -> Result:
    """A random loop that rubs in every joint, for three of its time scales."""
    case = rubbing("loop", seed)
    until = 3.0 * time_scale(case)
    return simulate(case.scene, until=until, every=until, method=method, rtol=rtol, outputs=["energy.kinetic"])


@pytest.mark.parametrize(
    ("seed", "part", "settings"),
    [
        # a ball's friction folds away where its branch ends, and not where Newton's method first comes to the other one; and a ball
        # that turns about its contact leaves its cone and comes back within a step
        (0, 1.0, [("rk5", 1e-7), ("rk8", 1e-7)]),
        # what others' contacts were before two pairs turn round is known from before, not from what round-off has there
        (11, 1.0, [("rk5", 1e-5), ("rk5", 1e-6), ("rk8", 1e-8)]),
        # what comes to rest has friction along the direction that it had: along that of round-off there was none, and runs went
        # on by folds
        (34, 1.0, [("rk8", 1e-7), ("rk5", 1e-8)]),
        # where a pair on a line turns round, and its friction with it, no ball beside it comes to its cone
        (27, 0.4, [("rk5", 1e-8)]),
    ],
)
def test_a_loop_has_the_same_events_at_every_setting(seed: int, part: float, settings: list[tuple[str, float]]) -> None:
    """Up to a part of the run."""
    exact = run(seed, "rk8", 1e-10)
    until = exact.settings["until"]
    for method, rtol in settings:
        assert difference(run(seed, method, rtol), exact, rtol, until, part * until) == "", (method, rtol)
