"""Ctrl-C deferred until the work is in a consistent state.

Python may raise KeyboardInterrupt between any two instructions, for example between a call that computes rows and the line that
stores them. In a block of ``held``, Ctrl-C only sets a flag, which the work checks where it can stop. In a block of
``DeferredInterrupt.open``, Ctrl-C raises at once; these blocks are for long calls without side effects, such as a compiler. Only
the main thread receives signals; work in another thread runs in a block of ``watched``. ``heed`` checks for Ctrl-C and calls the
thread's watch."""

from __future__ import annotations

# ``_signal`` is the C part of ``signal``. Functions of the latter turn handlers into enumerations, and take ten times as long.
import _signal  # type: ignore[import-not-found]
import threading
from contextlib import contextmanager

TYPE_CHECKING = False  # ``typing`` takes as long as Python's own start
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType
    from typing import Any


class DeferredInterrupt:
    """State of Ctrl-C in a block of ``held``. asked: whether Ctrl-C has been pressed. lets_through: whether Ctrl-C raises
    KeyboardInterrupt."""

    asked = False
    lets_through = False
    _around: DeferredInterrupt | None = None
    _handler: Any = None

    def __enter__(self) -> DeferredInterrupt:
        global _in_force
        around = _in_force
        handler = _signal.getsignal(_signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
        if handler is _signal.default_int_handler or (around is not None and around.lets_through and handler == around.note):
            _signal.signal(_signal.SIGINT, self.note)
            self._around, self._handler, _in_force = around, handler, self
        return self

    def __exit__(self, *exc: object) -> None:
        global _in_force
        if self._handler is not None:
            _in_force = self._around
            _signal.signal(_signal.SIGINT, self._handler)
            self._handler = None

    @property
    def heard(self) -> bool:
        """Whether Ctrl-C has been pressed and may raise KeyboardInterrupt now."""
        return self.asked and self.lets_through

    def note(self, number: int, frame: FrameType | None) -> None:
        """Signal handler that records Ctrl-C. Only the first Ctrl-C raises, so that a second one does not disturb the clean-up."""
        again, self.asked = self.asked, True
        if self.lets_through and not again:
            raise KeyboardInterrupt

    @contextmanager
    def open(self) -> Iterator[None]:
        """In this block, Ctrl-C raises KeyboardInterrupt. If Ctrl-C was pressed before, the block begins with this exception."""
        self.lets_through = True
        try:
            if self.asked:
                raise KeyboardInterrupt
            yield
            if self.asked:  # a library has caught the KeyboardInterrupt and dropped it
                raise KeyboardInterrupt
        except Exception:
            if self.asked:  # a library has turned the KeyboardInterrupt into another exception
                raise KeyboardInterrupt from None
            raise
        finally:
            self.lets_through = False


def held() -> DeferredInterrupt:
    """Defer Ctrl-C during the block; only in the main thread, which receives the signal. Replaces two signal handlers: that of
    Python, and that of an enclosing ``DeferredInterrupt`` whose ``open`` block surrounds this block. A program's own handler
    stays."""
    return DeferredInterrupt()


_in_force: DeferredInterrupt | None = None
"""The innermost block of the main thread that defers interrupts."""


def heed() -> None:
    """In a block of ``DeferredInterrupt.open``, raise KeyboardInterrupt if Ctrl-C has been pressed. Then call the watch of this
    thread. (The signal handler's own exception may be lost in a library that catches all exceptions, such as CasADi's wrappers.)"""
    if _in_force is not None and _in_force.heard:
        raise KeyboardInterrupt
    if (look := getattr(_watch, "look", None)) is not None:
        look()


@contextmanager
def watched(look: Callable[[], object]) -> Iterator[None]:
    """In this block, on this thread, ``heed`` also calls ``look``, which may raise an exception to end the work (job cancelled,
    time used up). ``look`` must be fast, because it is called 100 times a second or more often."""
    around = getattr(_watch, "look", None)
    _watch.look = look
    try:
        yield
    finally:
        _watch.look = around


_watch = threading.local()


class Unwanted(Exception):
    """Raised by a watch: the result is no longer needed."""
