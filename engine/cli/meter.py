"""A progress bar for work that comes in pieces: what is measured now, how many are done. None when stderr is no terminal."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any

from engine.cli.terminal import moves


class Meter:
    """A progress bar as a context manager: hand its ``tell`` to the work inside."""

    def __init__(self, what: str):
        self.what = what
        self.bar: Any = None
        self.task: Any = None

    def __enter__(self) -> Meter:
        if moves(sys.stderr):
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
            self.bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self.task = self.bar.add_task(self.what, total=None)
            self.bar.start()
        return self

    def tell(self, now: str, done: int, total: int) -> None:
        """What is being measured, how many pieces are done, how many there are."""
        if self.bar is not None:
            self.bar.update(self.task, description=f"{self.what}: {now}", completed=done, total=total)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.bar is not None:
            self.bar.stop()
