"""The real dispatcher with its real store (SQLite) and any number of workers that only wait, on one machine."""

from __future__ import annotations

import heapq
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from trunnion.service.basics.prometheus_metrics import Metrics
from trunnion.service.basics.server_settings import Settings
from trunnion.service.executor.chunk_dispatcher import Dispatcher
from trunnion.service.executor.chunk_size import COMMIT_SIZE, DispatchCost
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.executor.part_file_format import CaseRange
from trunnion.service.store.leases_and_chunks import WorkStore


class FixedDispatchCost(DispatchCost):
    """Sizes of chunks that do not depend on the cost of dispatching chunks."""

    def record(self, pieces: int, seconds: float) -> None:
        """Do nothing: measured costs are ignored."""


@dataclass
class PendingResult:
    """A future for the result of a piece that a worker has not finished yet."""

    said: dict[str, Any]
    status: str = "pending"
    calls: list[Callable[[Any], None]] = field(default_factory=list)

    def add_done_callback(self, call: Callable[[Any], None]) -> None:
        """Call the function when the result is available."""
        self.calls.append(call)

    def result(self, timeout: float = 0.0) -> dict[str, Any]:
        """The result of the piece."""
        return self.said

    def cancel(self) -> None:
        """Do nothing, because no client waits for the result."""

    def say(self) -> None:
        """Set the result now."""
        self.status = "finished"
        for call in self.calls:
            call(self)


class WaitingCluster:
    """A cluster of workers. Each worker takes one chunk after the other, and waits as long as stepping would take. case: seconds
    per case."""

    def __init__(self, workers: int, case: float):
        self.counted, self.case = workers, case
        self.free = [0.0] * workers
        self.due: list[tuple[float, int, PendingResult]] = []
        self.number = 0
        self.changed = threading.Condition()
        threading.Thread(target=self._run, daemon=True).start()

    def slots(self) -> int:
        """Number of workers."""
        return self.counted

    def submit_reporting(self, function: Any, url: str, piece: CaseRange, *_: Any) -> PendingResult:
        """Give a piece to the worker that is free first."""
        n = piece.stop - piece.start
        later = PendingResult({"counts": {"done": n}, "seconds": n * self.case, "build_seconds": 0.0, "bytes": 25 * n})
        with self.changed:
            over = max(heapq.heappop(self.free), time.monotonic()) + n * self.case
            heapq.heappush(self.free, over)
            self.number += 1
            heapq.heappush(self.due, (over, self.number, later))
            self.changed.notify()
        return later

    def _run(self) -> None:
        while True:
            with self.changed:
                while not self.due or self.due[0][0] > time.monotonic():
                    self.changed.wait(self.due[0][0] - time.monotonic() if self.due else None)
                later = heapq.heappop(self.due)[2]
            later.say()


def real(cases: int, workers: int, case: float, learns: bool) -> tuple[float, int, float]:
    """(seconds from submission to the job's end, number of chunks, time of the dispatcher for a chunk at the end, s)."""
    with tempfile.TemporaryDirectory() as folder:
        store, parts = WorkStore(f"sqlite:///{folder}/jobs.db"), Parts(f"{folder}/results")
        store.upgrade()
        dispatcher = Dispatcher(store, WaitingCluster(workers, case), parts, Settings(Path(folder)), Metrics())  # type: ignore[arg-type]
        learnt = dispatcher.dispatch_cost
        if not learns:
            dispatcher.dispatch_cost = FixedDispatchCost()
        job, _ = store.submit("me", "d", "scene", "", "{}", cases, 1e9)
        began = time.perf_counter()
        dispatcher.start()
        while (found := store.job(job.id)) is not None and found.state in ("queued", "running"):
            time.sleep(0.05)
        seconds, pieces = time.perf_counter() - began, len(store.finished(job.id))
        dispatcher.stop()
        store.close()
        return seconds, pieces, learnt.cost(COMMIT_SIZE)
