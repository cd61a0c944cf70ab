"""A joint at rest whose contact is unloaded for a short time slips then, however short this time is compared with a step."""

from __future__ import annotations

import pytest

from tests.reference.scenes.capacity_dips import UNTIL, dips
from trunnion import scene_from_dict, simulate

METHODS = ("auto", "rk5", "rk8", "rosenbrock")
SETTINGS = [*((m, x) for m in METHODS for x in (1e-3, 1e-6, 1e-9)), ("moreau", 1e-6)]


def wrong(seed: int, method: str, rtol: float) -> str:
    """The difference from the closed form; "" without one. Loads depend on time only, so times do not depend on the tolerance of a
    method that locates events."""
    case = dips(seed)
    if case is None:
        return ""
    r = simulate(scene_from_dict(case.scene), method=method, rtol=rtol, every=UNTIL, kernel="parts", outputs=["guide.q*"])
    found = [e.time for e in r.events if e.kind == "slip"]
    if r.outcome.name != "done" or len(found) != len(case.slips):
        return f"{seed} {method} {rtol:g}: {r.outcome.name}, {len(found)} slips for {len(case.slips)}"
    late = max((abs(a - b) for a, b in zip(found, case.slips, strict=True)), default=0.0)
    return f"{seed} {method} {rtol:g}: {late:.1e} s off" if late > (1e-5 if method == "moreau" else 1e-7) else ""


def test_a_brief_loss_of_load_is_found() -> None:
    """In half of these scenes, the friction ratio has a peak narrower than the distance of two points of a step."""
    assert [w for seed in range(12) for m, x in SETTINGS[seed % 3 :: 3] if (w := wrong(seed, m, x))] == []


@pytest.mark.slow
def test_many_brief_losses_of_load_are_found() -> None:
    assert [w for seed in range(500) for m, x in SETTINGS if (w := wrong(seed, m, x))] == []
