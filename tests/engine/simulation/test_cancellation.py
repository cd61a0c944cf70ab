"""During long work, the runtime asks its host whether to continue: at the start and during steps, at intervals that depend on the
work."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from tests.engine.mechanisms.friction_chains import balls
from tests.engine.mechanisms.scissor_lift import scissor
from tests.engine.stick_slip.test_active_set_many_pairs import links, rough, work
from trunnion.basics.interrupts import DeferredInterrupt, Unwanted, watched
from trunnion.runtime.abi import Status
from trunnion.scene.data_classes import scene as sm
from trunnion.scene.overrides import apply
from trunnion.simulation.execution import run_loop
from trunnion.simulation.run import Model, simulate
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.simulation.runtime_interface.cancellation import cancellable


def started(stop: int) -> tuple[int, int]:
    """Outcome and cost of a start. The start is cancelled at request number ``stop``."""
    model, settings, asked = Model(rough(0, 16), "j0.q[*]"), bl.Settings(), []
    model.block.configure(settings)
    assert model.block.assemble() == 1

    def give_up() -> bool:
        asked.append(1)
        return len(asked) >= stop

    with model.block.cancellable(give_up):
        row = np.zeros(model.block.width)
        status = model.block.lib.tr_start(model.block.at, 0.0, 1.0, 0.1, row.ctypes.data)
    return status, work(model)


def test_a_start_ends_as_soon_as_it_is_cancelled() -> None:
    status, first = started(1)
    assert status == Status.CANCELLED
    status, third = started(3)
    assert status == Status.CANCELLED
    assert first < third < 4 * first


def test_ctrl_c_is_raised_when_the_work_it_gives_up_has_come_back() -> None:
    model = Model(rough(0, 16), "j0.q[*]")
    model.block.configure(bl.Settings())
    assert model.block.assemble() == 1

    def pressed() -> bool:
        signal.raise_signal(signal.SIGINT)
        return False

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), model.block.cancellable(pressed):
            model.block.lib.tr_start(model.block.at, 0.0, 1.0, 0.1, np.zeros(model.block.width).ctypes.data)
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_block_that_moves_in_memory_during_a_request_is_found_again() -> None:
    """The Jacobian unit is attached in a larger block. After the work, other data occupy the memory of the old block."""
    told: list[tuple[int, bool]] = []

    class Library:
        """Stand-in for the library that records which runs ask for cancellation."""

        @staticmethod
        def tr_ask(at: int, host: object) -> None:
            told.append((at, host is not None))

    places = iter((1, 2))
    with cancellable(Library, lambda: next(places), lambda: False):  # type: ignore[arg-type]
        pass
    assert told == [(1, True), (2, False)]


def test_a_long_search_for_a_closed_loop_asks_whether_it_is_cancelled() -> None:
    """A bar of a scissor lift is far too long. No position closes the loop, and the search tries many positions."""
    given = scissor(3)
    free = {n: replace(j, start=sm.Start()) if n[-1] in "12" else j for n, j in given.joints.items()}
    model = Model(apply(replace(given, joints=free), {"bodies.b2.points.low": [-100.0, 0.0, 0.0]}), "guide.q[*]")
    model.block.configure(bl.Settings())

    def unwanted() -> None:
        raise Unwanted

    with pytest.raises(Unwanted), watched(unwanted):
        model.block.assemble()
    assert model.block.assemble() == 0


class At(DeferredInterrupt):
    """An interrupt that comes with the n-th request of the runtime."""

    def __init__(self, n: int):
        self.left = n

    @property
    def asked(self) -> bool:
        self.left -= 1
        return self.left <= 0

    @asked.setter
    def asked(self, value: bool) -> None:
        pass


def interrupted_at(monkeypatch: pytest.MonkeyPatch, n: int) -> None:
    """Run a scene and interrupt it at its n-th request."""

    @contextmanager
    def at_the_nth() -> Iterator[DeferredInterrupt]:
        yield At(n)

    monkeypatch.setattr(run_loop, "held", at_the_nth)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("n", [40, 100, 130, 160])
def test_a_run_that_is_given_up_while_it_passes_a_failure_has_not_failed(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of thirty balls. Its modes are not consistent, and the search for other modes is cancelled."""
    interrupted_at(monkeypatch, n)
    assert simulate(balls(30, 0), until=0.1, kernel="parts", outputs="j0.q[*]").outcome.name == "cancelled"


def test_a_run_that_is_given_up_inside_a_call_keeps_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    interrupted_at(monkeypatch, 3)
    r = simulate(links(10, 1, "spherical", apart=False), until=1.0, every=0.001, outputs="j0.q[*]")
    assert r.outcome.name == "cancelled"
    assert 1 <= len(r.time) < 1000
    assert np.isfinite(r.data).all()
