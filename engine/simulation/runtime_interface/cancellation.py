"""Cancellation of long work in the runtime, which calls its host every few milliseconds."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from trunnion.basics.interrupts import heed, held

HOST = ctypes.CFUNCTYPE(ctypes.c_int)
"""Type of the function that the runtime calls; 1: give up."""


@contextmanager
def cancellable(lib: ctypes.CDLL, at: Callable[[], int], stop: Callable[[], bool]) -> Iterator[None]:
    """Allow ``stop`` and Ctrl-C to end long work in a block. at: the block's address, which may change.

    Ctrl-C raises KeyboardInterrupt at the end, unless a caller holds it back. Errors raised by this thread's cancellation check
    (``heed``) are passed on, too."""
    raised: list[BaseException] = []

    def gives_up() -> int:
        try:
            heed()
            return int(interrupt.asked or stop())
        except BaseException as e:  # noqa: BLE001  # exceptions cannot pass through C: it is raised below
            raised.append(e)
            return 1

    with held() as interrupt:
        host = HOST(gives_up)
        lib.tr_ask(at(), ctypes.cast(host, ctypes.c_void_p))
        try:
            yield
        finally:
            lib.tr_ask(at(), None)
    if raised:
        raise raised[0]
    if interrupt.asked:
        raise KeyboardInterrupt
