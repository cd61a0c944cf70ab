"""Cancellation of long work in the runtime. Every few milliseconds the runtime calls a function of the host, which may cancel."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable

from trunnion.basics.interrupts import heed, held

HOST = ctypes.CFUNCTYPE(ctypes.c_int)
"""Type of the function that the runtime calls. The result 1 cancels the work."""


class cancellable:  # the name is in lower case, because the class is used like a function
    """Allow the function ``stop`` and Ctrl-C to end long work of a simulation block. at: returns the block's address, which may
    change.

    After Ctrl-C, KeyboardInterrupt is raised at the end of the context, unless a caller holds Ctrl-C back. Exceptions that ``heed``
    raises in this thread are raised at the end of the context, too."""

    def __init__(self, lib: ctypes.CDLL, at: Callable[[], int], stop: Callable[[], bool]):
        self._lib, self._at, self._stop = lib, at, stop
        self._raised: BaseException | None = None
        self._interrupt = held()

    def __enter__(self) -> None:
        self._interrupt.__enter__()
        self._around, _threads.innermost = _threads.innermost, self
        self._lib.tr_ask(self._at(), _ADDRESS)

    def __exit__(self, kind: type[BaseException] | None, *exc: object) -> None:
        self._lib.tr_ask(self._at(), None)
        _threads.innermost = self._around
        self._interrupt.__exit__()
        if kind is None and self._raised is not None:
            raise self._raised
        if kind is None and self._interrupt.asked:
            raise KeyboardInterrupt

    def gives_up(self) -> int:
        """Whether to end the work of the block."""
        try:
            heed()
            return int(self._interrupt.asked or self._stop())
        except BaseException as e:  # noqa: BLE001  # an exception cannot pass through C; it is raised at the end
            self._raised = self._raised or e
            return 1


class _Threads(threading.local):
    innermost: cancellable | None = None
    """The innermost context of this thread."""


_threads = _Threads()


def _gives_up() -> int:
    found = _threads.innermost
    return 0 if found is None else found.gives_up()


_HOST = HOST(_gives_up)
"""The function that C calls. All contexts share this function, because its creation takes longer than a call into C."""
_ADDRESS = ctypes.cast(_HOST, ctypes.c_void_p)
