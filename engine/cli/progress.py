"""A progress bar on standard error for whatever takes more than a second; none when that is not a terminal."""

from __future__ import annotations

import sys
import threading
from types import TracebackType
from typing import Any

from engine.cli.terminal import moves

PATIENCE = 1.0
"""Seconds before anything is shown."""


class Watch:
    """A progress bar as a context manager: hand its ``tell`` to a run as ``progress``. It shows the building, then the time
    reached."""

    def __init__(self, what: str):
        self.what = what
        self.bar: Any = None
        self.task: Any = None
        self.lock = threading.Lock()
        self.over = False
        self.now: tuple[str, int, int] | None = None
        self.timer: threading.Timer | None = None

    def __enter__(self) -> Watch:
        if moves(sys.stderr):
            self.timer = threading.Timer(PATIENCE, self._show)
            self.timer.daemon = True
            self.timer.start()
        return self

    def _show(self) -> None:
        """Open the bar (called by the timer, from another thread)."""
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[reached]}"))
        with self.lock:
            if self.over:
                return
            self.bar = Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=Console(stderr=True), transient=True)
            self.task = self.bar.add_task(f"{self.what}: building", total=None, reached="")
            self.bar.start()
            self._tell_part()

    def tell(self, time: float, until: float) -> None:
        """Progress of a run: the time it has reached."""
        with self.lock:
            if self.bar is not None:
                reached = f"t = {time:.4g} of {until:.4g} s"
                self.bar.update(self.task, description=self.what, total=until, completed=time, reached=reached)

    def part(self, what: str, done: int, of: int) -> None:
        """Progress of work in parts: what is being done now, parts done, parts in all."""
        with self.lock:
            self.now = (what, done, of)
            self._tell_part()

    def _tell_part(self) -> None:
        if self.bar is not None and self.now is not None:
            what, done, of = self.now
            self.bar.update(self.task, description=f"{self.what}: {what}", total=of, completed=done, reached=f"{done} of {of}")

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.timer is not None:
            self.timer.cancel()
        with self.lock:
            self.over = True
            if self.bar is not None:
                self.bar.stop()
