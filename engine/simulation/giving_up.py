"""Long work in the runtime asks its host, every few milliseconds of it, whether to give up."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from engine.basics.interrupts import heed, held

HOST = ctypes.CFUNCTYPE(ctypes.c_int)
"""What the runtime calls."""


@contextmanager
def asking(lib: ctypes.CDLL, at: Callable[[], int], stop: Callable[[], bool]) -> Iterator[None]:
    """While this lasts, what takes long in the block that is ``at`` an address, which may change, asks ``stop``; most calls end
    before they ask. Ctrl-C, where nobody holds it back already, is a yes, and KeyboardInterrupt is raised here; so is what the
    watch of this thread raises (``heed``)."""
    raised: list[BaseException] = []

    def gives_up() -> int:
        try:
            heed()
            return int(interrupt.asked or stop())
        except BaseException as e:  # noqa: BLE001  # nothing passes through C: it is raised again behind it
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
