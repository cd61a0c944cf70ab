"""Ctrl-C put off until the work at hand is in a state worth keeping.

Python raises KeyboardInterrupt between any two instructions, so also between a call that has computed rows and the line that keeps
them. While interrupts are ``held`` they only leave a note, which the work looks at where it can stop; what may take long and leaves
nothing behind (a compiler) is let through with ``open``. Threads that get no signal are ``watched`` instead: long work heeds both.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


class Held:
    """Interrupts that are held back. asked: whether Ctrl-C has been pressed since."""

    def __init__(self) -> None:
        self.asked = False
        self.lets_through = False

    @property
    def heard(self) -> bool:
        """Whether Ctrl-C has been pressed and is let through."""
        return self.asked and self.lets_through

    def note(self, number: int, frame: FrameType | None) -> None:
        """The handler of the signal: remember that Ctrl-C was pressed. Pressed again it leaves alone what the first makes end."""
        again, self.asked = self.asked, True
        if self.lets_through and not again:
            raise KeyboardInterrupt

    @contextmanager
    def open(self) -> Iterator[None]:
        """Within this block Ctrl-C raises KeyboardInterrupt as usual, and so does one that was pressed just before."""
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
    """Hold Ctrl-C back during the block. It does so only in the main thread, the only one that gets the signal, and only where
    nobody else handles it, or a block around this one lets it through: a program with a handler of its own keeps that."""
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
"""Those held back in the main thread now."""


def heed() -> None:
    """Raise KeyboardInterrupt if Ctrl-C has been pressed where it is let through, and what the watch of this thread raises. What
    was raised when it was pressed may have been swallowed by a library that was at work (the symbolic one's wrappers catch whatever
    they are told)."""
    if _in_force is not None and _in_force.heard:
        raise KeyboardInterrupt
    if (look := getattr(_watch, "look", None)) is not None:
        look()


@contextmanager
def watched(look: Callable[[], object]) -> Iterator[None]:
    """Within this block, on this thread, whatever heeds interrupts calls ``look`` too, which raises to end the work: a cancelled
    job's, one whose time is up. It is called a hundred times a second or oftener, so let it be quick."""
    around = getattr(_watch, "look", None)
    _watch.look = look
    try:
        yield
    finally:
        _watch.look = around


_watch = threading.local()


class Unwanted(Exception):
    """What a watch may raise: nobody waits for this work any more."""
