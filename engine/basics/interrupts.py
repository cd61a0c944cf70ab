"""Ctrl-C put off until the work at hand is in a state worth keeping.

Python raises KeyboardInterrupt between any two instructions, so also between a call that has computed rows and the line that keeps
them. While interrupts are ``held`` they only leave a note, which the work looks at where it can stop; what may take long and leaves
nothing behind (a compiler) is let through with ``open``.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Held:
    """Interrupts that are held back. asked: whether Ctrl-C has been pressed since."""

    def __init__(self) -> None:
        self.asked = False
        self._through = False

    def _note(self, number: int, frame: FrameType | None) -> None:
        """The handler of the signal: only remember that Ctrl-C was pressed."""
        self.asked = True
        if self._through:
            raise KeyboardInterrupt

    @contextmanager
    def open(self) -> Iterator[None]:
        """Within this block Ctrl-C raises KeyboardInterrupt as usual, and so does one that was pressed just before."""
        self._through = True
        try:
            if self.asked:
                raise KeyboardInterrupt
            yield
        finally:
            self._through = False


@contextmanager
def held() -> Iterator[Held]:
    """Hold Ctrl-C back during the block. It does so only in the main thread, the only one that gets the signal, and only where
    nobody else handles it: a program with a handler of its own keeps that."""
    note = Held()
    own = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not own:
        yield note
        return
    signal.signal(signal.SIGINT, note._note)
    try:
        yield note
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
