"""Ctrl-C deferred until the work is in a consistent state.

Python may raise KeyboardInterrupt between any two instructions, for example between a call that computes rows and the line that
stores them. In a block of ``held``, Ctrl-C only sets a flag, which the work checks where it can stop. In a block of
``DeferredInterrupt.open``, Ctrl-C raises KeyboardInterrupt at once. These blocks are for long calls without side effects, such as a
compiler. Only the main thread receives signals. Work in another thread runs in a block of ``watched``, which gives the thread a
function to call (its watch). ``heed`` checks for Ctrl-C and calls the watch of the thread."""

from __future__ import annotations

# ``_signal`` is the C part of ``signal``. The functions of ``signal`` take ten times as long.
import _signal  # type: ignore[import-not-found]
import threading
from contextlib import contextmanager

TYPE_CHECKING = False  # the import of ``typing`` takes as long as the start of Python
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
        """Signal handler that records Ctrl-C. Only the first Ctrl-C raises KeyboardInterrupt. A second Ctrl-C would disturb the
        clean-up."""
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
            if self.asked:  # a library has caught and dropped the KeyboardInterrupt
                raise KeyboardInterrupt
        except Exception:
            if self.asked:  # a library has turned the KeyboardInterrupt into another exception
                raise KeyboardInterrupt from None
            raise
        finally:
            self.lets_through = False


def held() -> DeferredInterrupt:
    """Defer Ctrl-C during the block. The block has an effect only in the main thread, which receives the signal. The block replaces
    Python's signal handler, or the handler of an enclosing ``DeferredInterrupt`` whose ``open`` block surrounds this block. A
    program's own handler is not replaced."""
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
    """In this block, on this thread, ``heed`` also calls ``look``. ``look`` may raise an exception to end the work (job cancelled,
    time used up). ``look`` must be fast, because it is called 100 times a second or more often."""
    around = getattr(_watch, "look", None)
    _watch.look = look
    try:
        yield
    finally:
        _watch.look = around


_watch = threading.local()


class Unwanted(Exception):
    """The result is no longer needed. A watch raises this exception."""
