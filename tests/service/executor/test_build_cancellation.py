"""A worker can stop its job while it derives and compiles equations. The worker does not wait for a compiler, and no incomplete
files remain.

The worker's function runs in this process, on a separate thread as in a worker. The test stops the job at a fixed place in the
work."""

from __future__ import annotations

import signal
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.engine.kernel.test_build_interrupts import GROUPS, SLEEPS, left
from trunnion.batch.sweep import _Work, run_plan
from trunnion.kernel import shared_libraries
from trunnion.kernel.compilation import compiler_processes, library_cache
from trunnion.service.basics.server_settings import Limits
from trunnion.service.executor import chunk_and_case_runs
from trunnion.service.executor.chunk_and_case_runs import Cancelled, OutOfTime, run_chunk
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange, digest_of, document_bytes
from trunnion.service.request_models.job_request import JobRequest, document_of, plan_of_document, plan_of_request

MU = "joints.ball.friction.mu"
ASKED = JobRequest.model_validate(
    {
        "scene": "spherical_pendulum",
        "vary": {MU: "0.1:0.6:4"},
        "reductions": ["final:ball.qd[2]"],
        "until": 0.01,
        "kernel": "compiled",
    }
)
JOB = document_of(ASKED, plan_of_request(ASKED, Limits()))


@pytest.fixture
def parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Parts:
    """The state of a job that has no kernel yet. The worker looks for a stop wherever it can end its work."""
    from trunnion.simulation.runtime_interface.c_signatures import library as stepping

    stepping()
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(chunk_and_case_runs, "MARKER_SECONDS", 0.0)
    monkeypatch.setattr(chunk_and_case_runs, "CHECK_SHARE", float("inf"))
    there = Parts(str(tmp_path / "parts"))
    there.write(there.job_file("a"), document_bytes(JOB))
    return there


def chunk(parts: Parts, seconds: float = 600.0) -> BaseException | dict[str, Any]:
    """The worker's result for the job's only chunk, or its exception."""
    found: list[BaseException | dict[str, Any]] = []

    def working() -> None:
        try:
            found.append(run_chunk(parts.url, CaseRange("a", digest_of(document_bytes(JOB)), 0, 4), seconds))
        except BaseException as e:  # noqa: BLE001
            found.append(e)

    thread = threading.Thread(target=working)
    thread.start()
    thread.join()
    return found[0]


def stopped_by(monkeypatch: pytest.MonkeyPatch, stop: Callable[[], None]) -> list[Any]:
    """Compilers that take ten minutes. The test calls ``stop`` as soon as the first compiler has started. Returns the compilers
    that were started."""
    started: list[Any] = []
    popen = subprocess.Popen

    def sleeping(command: list[str], **how: Any) -> Any:
        started.append(popen(SLEEPS, **how))
        stop()
        return started[-1]

    monkeypatch.setattr(compiler_processes.subprocess, "Popen", sleeping)
    return started


@GROUPS
def test_a_cancelled_job_waits_for_no_compiler(parts: Parts, monkeypatch: pytest.MonkeyPatch) -> None:
    started = stopped_by(monkeypatch, lambda: parts.write(parts.marker("a"), b""))
    assert isinstance(chunk(parts), Cancelled)
    assert started
    assert all(p.returncode == -signal.SIGKILL for p in started)
    assert left(library_cache.cache_folder()) == []


def test_a_job_that_is_cancelled_while_it_is_derived_starts_no_compiler(parts: Parts, monkeypatch: pytest.MonkeyPatch) -> None:
    make = shared_libraries._build_kernel

    def derives(*given: Any) -> None:
        parts.write(parts.marker("a"), b"")
        make(*given)

    monkeypatch.setattr(shared_libraries, "_build_kernel", derives)
    monkeypatch.setattr(shared_libraries, "_compile_unit", lambda *given: pytest.fail("a compiler was to start"))
    assert isinstance(chunk(parts), Cancelled)
    assert left(library_cache.cache_folder()) == []


def test_a_budget_of_time_ends_a_build(parts: Parts, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_libraries, "_compile_unit", lambda *given: pytest.fail("a compiler was to start"))
    assert isinstance(chunk(parts, seconds=0.0), OutOfTime)
    assert left(library_cache.cache_folder()) == []


@pytest.mark.slow
def test_a_job_builds_a_kernel_whose_build_another_job_has_cancelled(parts: Parts, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cancelled job runs in the same worker, with the same kernel."""
    monkeypatch.setenv("TRUNNION_QUICK_BUILD", "1")
    parts.write(parts.marker("a"), b"")
    assert isinstance(chunk(parts), Cancelled)
    parts.fs.rm_file(parts.marker("a"))
    found = chunk(parts)
    assert isinstance(found, dict)
    assert found["counts"] == {"done": 4}


@GROUPS
def test_a_sweep_that_is_interrupted_waits_for_no_compiler(parts: Parts, monkeypatch: pytest.MonkeyPatch) -> None:
    """The threads of a sweep do not receive the signal of Ctrl-C, so the main thread informs them."""
    of, its = plan_of_document(JOB), []
    take = _Work.take
    monkeypatch.setattr(_Work, "take", lambda w: (its.append(w), take(w))[1])

    def stop() -> None:
        its[0].stopped = its[0].interrupted = True

    started = stopped_by(monkeypatch, stop)
    with pytest.raises(KeyboardInterrupt):
        run_plan(of, 1)
    assert all(p.returncode == -signal.SIGKILL for p in started)
    assert left(library_cache.cache_folder()) == []
