"""Programs at work on a build, side by side, which end together: Ctrl-C waits for none of them, and neither does a failure."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from contextvars import ContextVar, copy_context
from tempfile import TemporaryFile
from threading import Lock
from typing import Any

from engine.basics.interrupts import heed

LOOKS = 0.05
"""Seconds between two looks for Ctrl-C, and for whether a job is still wanted, while a thread is waited for."""
Submit = Callable[..., "Future[Any]"]
"""Starts a function with its arguments on a thread."""


class Ended(RuntimeError):
    """The work that a program was to do is not wanted any more."""


class Programs:
    """Those of one build. ended: whether no more are to be started."""

    def __init__(self) -> None:
        self.ended = False
        self._lock = Lock()
        self._running: set[subprocess.Popen[bytes]] = set()

    def run(self, command: Sequence[str], env: Mapping[str, str]) -> tuple[int, str]:
        """Run a program to its end: its exit code, and what it had to complain of. Ended when the build has been given up."""
        with TemporaryFile("w+", errors="replace") as told:  # a pipe would be held open by the programs that it starts
            with self._lock:
                if self.ended:
                    raise Ended
                process = subprocess.Popen(
                    command, env=dict(env), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=told, start_new_session=True
                )
                self._running.add(process)
            try:
                code = process.wait()
            except BaseException:
                _kill(process)
                raise
            finally:
                self._running.discard(process)
            if self.ended:
                raise Ended
            told.seek(0)
            return code, told.read()

    def end(self) -> None:
        """End those that run; no others start."""
        with self._lock:
            self.ended = True
            for process in tuple(self._running):
                _kill(process)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a program, and with it those that it has started (where the system has groups of them)."""
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
    process.wait()


_CURRENT: ContextVar[Programs | None] = ContextVar("programs", default=None)


def run(command: Sequence[str], env: Mapping[str, str]) -> tuple[int, str]:
    """Run a program as one of those of the build around it, or by itself where there is none; it ends with that."""
    around = _CURRENT.get()
    if around is not None:
        return around.run(command, env)
    with side_by_side(1) as submit:
        found: tuple[int, str] = awaited(submit(run, command, env))
    return found


def awaited(work: Future[Any]) -> Any:
    """The result of work on another thread. Ctrl-C, and who watches this one, is heeded meanwhile: no signal ends such a wait
    everywhere, and other threads get none."""
    while not wait([work], LOOKS).done:
        heed()
    return work.result()


@contextmanager
def side_by_side(threads: int) -> Iterator[Submit]:
    """Work on so many threads. What goes wrong in the block, Ctrl-C included, ends the programs of all of them."""
    programs = Programs()
    before = _CURRENT.set(programs)
    pool = ThreadPoolExecutor(threads)
    try:
        yield lambda work, *given: pool.submit(copy_context().run, work, *given)
    except BaseException:
        programs.end()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        _CURRENT.reset(before)
