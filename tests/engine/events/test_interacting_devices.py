"""Scenes with interacting devices end alike at every setting: with the same outcome, events, times, end state and works."""

from __future__ import annotations

import pytest

from tests.engine.checks.runs_at_five_settings import MANY, SETTINGS, runs
from tests.engine.loops.test_cut_choice import cut_everywhere
from tests.reference.scenes.random_device_scenes import FAMILIES, crossed
from trunnion import simulate

SEEDS = 118
"""Number of seeds of each family in the slow test: 2,006 scenes of 17 families."""
ALIKE = 0.99
"""Required share of scenes whose runs agree. Runs that end with the same named outcome at all settings count as equal."""
AUDITED = 1e-5
"""Largest energy residual of a run at 1e-6, J. Energies of the scenes are about 1 J."""
QUICK: tuple[tuple[str, float, str], ...] = (("auto", 1e-6, "auto"), ("rosenbrock", 1e-6, "auto"), ("auto", 1e-9, "auto"))
"""Settings of the short test, on one kernel."""
ONE_KERNEL = tuple((m, rtol, "auto") for m, rtol, _ in SETTINGS)
FAILED = {"ratchets_in_loops": (0, 3, 20050), "hooks_in_loops": (6,), "planets": (0, 4, 20073),
          "stops_beside_sticking_pairs": (10,), "bevel_differentials": (66,), "drives_that_die": (20000,),
          "valve_trains": (20035,), "five_bars": (20092,), "geared_linkages": (20037,)}
CHOSEN: dict[str, tuple[int, ...]] = dict.fromkeys(FAMILIES, (1,)) | FAILED
"""Seeds of the short test."""


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("family", FAMILIES)
def test_scenes_of_interacting_devices_end_alike_at_every_setting(family: str) -> None:
    for seed in CHOSEN[family]:
        found = runs(crossed(family, seed), QUICK)
        assert set(found.outcomes) == {"done"}, (seed, found.outcomes)
        assert found.alike, (seed, found.differences)


@pytest.mark.parametrize(("family", "seed", "until", "method", "rtol"), [
    ("gear_trains", 1408, 0.42, "auto", 1e-9),
    ("drives_that_die", 1412, 0.802, "rosenbrock", 1e-6),
])  # fmt: skip
def test_round_off_of_forces_or_rates_ends_no_run(family: str, seed: int, until: float, method: str, rtol: float) -> None:
    """Round-off accelerates an unloaded pair, and the pair is held. Pairs that a drive releases move with the drive from the first
    instant."""
    run = simulate(crossed(family, seed), until=until, every=until, method=method, rtol=rtol, kernel="parts", outputs="*.q*")
    assert run.outcome.name == "done", run.outcome


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_many_scenes_of_interacting_devices_end_alike_at_every_setting(family: str) -> None:
    """The test compiles the last kernel for every tenth seed. It lists the scenes that differ or have a named outcome (``-rP``)."""
    different, named = [], []
    for seed in range(SEEDS):
        found = runs(crossed(family, seed), SETTINGS if seed % 10 == 0 else ONE_KERNEL)
        steps = [r.stats.steps for r in found.results]
        if not found.alike:
            different.append((seed, found.outcomes, *found.differences))
        elif set(found.outcomes) != {"done"} or max(steps) > MANY * max(5, min(steps)):
            named.append((seed, found.outcomes, steps))
    print(f"{SEEDS - len(different)} of {SEEDS} alike", "different:", *different, "ends by name or many steps:", *named, sep="\n")
    assert len(different) <= max(1.0, (1.0 - ALIKE) * SEEDS)


def test_pairs_that_have_just_started_do_not_stop_where_one_without_a_load_is_released() -> None:
    """No load presses a slide. A damper pulls this slide as soon as a gear unit moves the slide beside it."""
    found = simulate(crossed("locked_feeds", 2002), until=1e-6, every=1e-6, method="rk5", kernel="parts", max_steps=50)
    assert found.outcome.name == "done"
    assert [(e.joint, e.kind) for e in found.events] == [("rail2", "slip")]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", [3, 14, 19, 30, 55, *(pytest.param(k, marks=pytest.mark.slow) for k in range(60, 200))])
def test_a_pair_that_has_just_reversed_slides_on_where_another_pair_is_released(seed: int) -> None:
    """Steps are long, so that a pair is released in a step that begins with a reversal. The state does not contain the rates of cut
    joints."""
    cuts = cut_everywhere(crossed("drives_that_die", seed)).values()
    found = [simulate(s, rtol=1e-6, kernel="parts", outputs=["energy.residual"], max_steps=5000) for s in cuts]
    assert {r.outcome.name for r in found} == {"done"}
    changes = [sorted((e.kind, e.joint) for e in r.events if e.kind in ("slip", "stick", "reversal")) for r in found]
    assert all(c == changes[0] for c in changes)
    assert max(abs(r["energy.residual"][-1]) for r in found) < AUDITED
