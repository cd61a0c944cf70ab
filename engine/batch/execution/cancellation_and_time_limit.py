"""Cancellation of batches and time limits of cases, also within calls into C."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf

from trunnion.simulation.runtime_interface.cancellation import HOST

CALL_SECONDS = 0.02
"""Target duration of a call into C, s. Progress, cancellation and Ctrl-C must be served within 50 ms."""
Tick = Callable[[int], bool]
"""A function that receives the number of finished cases and returns whether to continue."""


class Watch:
    """Ends a batch if the caller's ``tick`` returns False, and ends a case at its time limit. C calls ``host`` every few
    milliseconds. cpu_limit: largest processor time of a case, s; None means no limit."""

    def __init__(self, cpu_limit: float | None) -> None:
        self.host, self.cpu_limit = HOST(self._gives_up), cpu_limit or inf
        self.begin(None, lambda: 0)

    def begin(self, tick: Tick | None, at: Callable[[], int]) -> None:
        """Watch a new batch. tick: function that receives the number of finished cases. at: function that returns this number,
        which is also the index of the present case."""
        self.tick, self.at, self.asked = tick, at, time.perf_counter()
        self.case, self.since = -1, 0.0
        self.raised: BaseException | None = None

    def is_over_limit(self) -> bool:
        """Whether the present case has exceeded its time limit. The first call of this function for a case starts the time of the
        case."""
        now = time.thread_time()
        if self.at() != self.case:
            self.case, self.since = self.at(), now
        return now - self.since > self.cpu_limit

    def _gives_up(self) -> int:
        now = time.perf_counter()
        if now - self.asked < CALL_SECONDS:
            return 0
        self.asked = now
        try:
            return int(self.is_over_limit() or (self.tick is not None and not self.tick(self.at())))
        except BaseException as e:  # noqa: BLE001  # exceptions cannot pass through C: pass_on raises e
            self.raised = e
            return 1

    def pass_on(self) -> None:
        """Raise the exception that ``tick`` raised in a call from C, if any."""
        if self.raised is not None:
            raise self.raised
