"""A progress bar for work of more than a second, on standard error if this is a terminal."""

from __future__ import annotations

import sys
import threading
from types import TracebackType
from typing import Any

from trunnion.cli.output.terminal_capabilities import is_redrawable

DELAY_SECONDS = 1.0
"""Time before the bar is shown."""


class ProgressBar:
    """A progress bar as a context manager. Work in the block calls ``show_time`` or ``show_count``."""

    def __init__(self, title: str, shown: bool = True):
        self.title = title
        self.shown = shown and is_redrawable(sys.stderr)
        self.state: dict[str, Any] = {"description": f"{title}: building", "total": None, "reached": ""}
        self.bar: Any = None
        self.task: Any = None
        self.lock = threading.Lock()
        self.timer: threading.Timer | None = None
        self.ended = False

    def __enter__(self) -> ProgressBar:
        if self.shown:
            self.timer = threading.Timer(DELAY_SECONDS, self.open)
            self.timer.daemon = True
            self.timer.start()
        return self

    def open(self) -> None:
        """Draw the bar. A timer calls this function in a separate thread."""
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[reached]}"))
        with self.lock:
            if self.ended:
                return
            self.bar = Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=Console(stderr=True), transient=True,
                                redirect_stdout=False)
            self.task = self.bar.add_task(**self.state)
            self.bar.start()

    def show_time(self, time: float, until: float) -> None:
        """Show the time that a run has reached, and the end time of the run, s."""
        self._show(self.title, time, until, f"t = {time:.4g} of {until:.4g} s")

    def show_count(self, done: int, total: int) -> None:
        """Show the number of finished cases, and the number of all cases."""
        self._show(self.title, done, total, f"{done} of {total}")

    def show_part(self, part: str, done: int, total: int) -> None:
        """Show the current part of the work, the number of finished parts, and the number of all parts."""
        self._show(f"{self.title}: {part}", done, total, f"{done} of {total}")

    def print_line(self, line: str) -> None:
        """Print a line of the answer. If the bar uses the same terminal, the line appears above the bar."""
        with self.lock:
            if self.bar is not None and sys.stdout.isatty():
                self.bar.console.print(line, markup=False, highlight=False)
            else:
                print(line, flush=True)

    def _show(self, description: str, done: float, total: float, reached: str) -> None:
        with self.lock:
            self.state = {"description": description, "total": total, "completed": done, "reached": reached}
            if self.bar is not None:
                self.bar.update(self.task, **self.state)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.timer is not None:
            self.timer.cancel()
        with self.lock:
            self.ended = True
            if self.bar is not None:
                self.bar.stop()
