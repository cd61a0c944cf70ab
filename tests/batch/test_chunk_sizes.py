"""Number of cases that a sweep gives to a thread at once."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from trunnion.batch import sweep
from trunnion.batch.preparation.case_parameters import Preparer


def test_chunks_grow_while_other_processes_hold_the_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between two checks, the clock advances by ten seconds, but the sweep uses only 10 ms of processor time."""
    now, used, sizes = [0.0], [0.0], []

    def later(time: list[float], by: float) -> float:
        time[0] += by
        return time[0]

    class Cases:
        """A runner whose cases take no time."""

        seconds = build_seconds = 0.0
        rows = None

        def __init__(self, plan: Any, preparer: Any) -> None:
            pass

        def chunk(self, start: int, stop: int, tick: Any) -> Any:
            sizes.append(stop - start)
            return SimpleNamespace(num_rows=stop - start)

    clock = SimpleNamespace(perf_counter=lambda: later(now, 10.0), thread_time=lambda: later(used, 0.01))
    monkeypatch.setattr(sweep, "time", clock)
    monkeypatch.setattr(sweep, "Runner", Cases)
    monkeypatch.setattr(sweep, "Preparer", lambda *_: None)
    work = sweep._Work(SimpleNamespace(cases=SimpleNamespace(count=2000, paths=(), ends=None), scene=None, run=None), None)  # type: ignore[arg-type]
    monkeypatch.setattr(work, "_finished", lambda *_: None)
    work._take()
    assert sizes == [16, 64, 256, 1024, 640]


def test_threads_share_the_scenes_that_they_build(monkeypatch: pytest.MonkeyPatch) -> None:
    """Threads share scenes. Otherwise each thread would build some thirty scenes to learn which parameters a number changes."""
    built = 0
    made = Preparer._made

    def counted(self: Preparer, changes: dict[str, float]) -> Any:
        nonlocal built
        built += 1
        return made(self, changes)

    monkeypatch.setattr(Preparer, "_made", counted)
    asked = {"sample": {"gravity[3]": (-9.9, -9.7)}, "count": 200, "reductions": "final:bob.position[1]", "until": 0.001}
    tables = []
    for workers in (1, 4):
        built = 0
        tables.append((sweep.sweep("simple_pendulum", kernel="parts", workers=workers, **asked).table, built))
    (alone, few), (together, many) = tables
    assert together.equals(alone)
    assert many <= few + sweep.FIRST_CHUNK
