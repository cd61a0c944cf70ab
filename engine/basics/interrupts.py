"""Ctrl-C deferred until the work is in a consistent state.

Python raises KeyboardInterrupt between any two instructions, also between a call that computes rows and the line that stores them.
While interrupts are ``held``, they only set a flag, which the work checks where it can stop. ``open`` lets them through during
long calls without side effects, such as a compiler. Threads without signals are ``watched`` instead; ``heed`` serves both."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


class Held:
    """Interrupts that are held back. asked: whether Ctrl-C has been pressed."""

    def __init__(self) -> None:
        self.asked = False
        self.lets_through = False

    @property
    def heard(self) -> bool:
        """Whether Ctrl-C has been pressed and is let through."""
        return self.asked and self.lets_through

    def note(self, number: int, frame: FrameType | None) -> None:
        """Signal handler: record Ctrl-C. A second Ctrl-C does not disturb the clean-up after the first."""
        again, self.asked = self.asked, True
        if self.lets_through and not again:
            raise KeyboardInterrupt

    @contextmanager
    def open(self) -> Iterator[None]:
        """Within this block Ctrl-C raises KeyboardInterrupt, also one pressed before."""
        self.lets_through = True
        try:
            if self.asked:
                raise KeyboardInterrupt
            yield
            if self.asked:  # a library has swallowed what was raised
                raise KeyboardInterrupt
        except Exception:
            if self.asked:  # or has made something else of it
                raise KeyboardInterrupt from None
            raise
        finally:
            self.lets_through = False


@contextmanager
def held() -> Iterator[Held]:
    """Hold Ctrl-C back during the block. Effective only in the main thread, which gets the signal, and only if the handler is
    Python's default or a block around lets interrupts through. A program's own handler stays in force."""
    global _in_force
    note, around = Held(), _in_force
    handler = signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    if not (handler is signal.default_int_handler or (around is not None and around.lets_through and handler == around.note)):
        yield note
        return
    signal.signal(signal.SIGINT, note.note)
    _in_force = note
    try:
        yield note
    finally:
        _in_force = around
        signal.signal(signal.SIGINT, handler)


_in_force: Held | None = None
"""The innermost block of the main thread that holds interrupts."""


def heed() -> None:
    """Raise KeyboardInterrupt if Ctrl-C has been pressed where it is let through; call the watch of this thread. The first
    exception may be lost in a library that catches everything, such as wrappers of the symbolic one."""
    if _in_force is not None and _in_force.heard:
        raise KeyboardInterrupt
    if (look := getattr(_watch, "look", None)) is not None:
        look()


@contextmanager
def watched(look: Callable[[], object]) -> Iterator[None]:
    """Within this block, on this thread, ``heed`` also calls ``look``, which may raise to end the work (job cancelled, time used
    up). Calls come 100 times a second or more often: ``look`` must be fast."""
    around = getattr(_watch, "look", None)
    _watch.look = look
    try:
        yield
    finally:
        _watch.look = around


_watch = threading.local()


class Unwanted(Exception):
    """Raised by a watch: the result is no longer needed."""
