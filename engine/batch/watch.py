"""Whether a batch goes on: asked in the middle of calls into C too."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf

from engine.simulation.giving_up import HOST

CALL_SECONDS = 0.02
"""A call into C is sized to last about this long: under the 50 ms after which progress, cancelling and Ctrl-C must be served."""
Tick = Callable[[int], bool]
"""tick(cases done of these rows) → go on?"""


class Watch:
    """Asks a tick whether to go on, and whether the case at hand has used up its patience, in the middle of a call into C too,
    every few milliseconds of whose work ``host`` is called. patience: processor seconds of a case."""

    def __init__(self, patience: float | None) -> None:
        self.host, self.patience = HOST(self._gives_up), patience or inf
        self.begin(None, lambda: 0)

    def begin(self, tick: Tick | None, at: Callable[[], int]) -> None:
        """From now on ask this one, which is told how many cases are done."""
        self.tick, self.at, self.asked = tick, at, time.perf_counter()
        self.case, self.since = -1, 0.0
        self.raised: BaseException | None = None

    def impatient(self) -> bool:
        """Whether the case at hand has taken longer than it may; its time counts from when it was first asked for."""
        now = time.thread_time()
        if self.at() != self.case:
            self.case, self.since = self.at(), now
        return now - self.since > self.patience

    def _gives_up(self) -> int:
        now = time.perf_counter()
        if now - self.asked < CALL_SECONDS:
            return 0
        self.asked = now
        try:
            return int(self.impatient() or (self.tick is not None and not self.tick(self.at())))
        except BaseException as e:  # noqa: BLE001  # nothing passes through C: it is raised again behind it
            self.raised = e
            return 1

    def pass_on(self) -> None:
        """Raise what the tick raised meanwhile."""
        if self.raised is not None:
            raise self.raised
