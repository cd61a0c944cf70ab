"""Cancellation of long work in the runtime. Every few milliseconds the runtime calls a function of the host, which may cancel."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from trunnion.basics.interrupts import heed, held

HOST = ctypes.CFUNCTYPE(ctypes.c_int)
"""Type of the function that the runtime calls. The result 1 cancels the work."""


@contextmanager
def cancellable(lib: ctypes.CDLL, at: Callable[[], int], stop: Callable[[], bool]) -> Iterator[None]:
    """Allow the function ``stop`` and Ctrl-C to end long work of a simulation block. at: returns the block's address, which may
    change.

    After Ctrl-C, KeyboardInterrupt is raised at the end of the context, unless a caller holds Ctrl-C back. Exceptions of this
    thread's watch (``heed``) are raised at the end, too."""
    raised: list[BaseException] = []

    def gives_up() -> int:
        try:
            heed()
            return int(interrupt.asked or stop())
        except BaseException as e:  # noqa: BLE001  # an exception cannot pass through C; it is raised below
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
