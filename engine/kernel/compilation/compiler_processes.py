"""Parallel compiler processes of a build. Ctrl-C or a failure ends all processes."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar, copy_context
from tempfile import TemporaryFile
from threading import Lock
from typing import TYPE_CHECKING, Any

from trunnion.basics.interrupts import heed

if TYPE_CHECKING:
    from concurrent.futures import Future

LOOKS = 0.05
"""Time, s, between checks for Ctrl-C and cancellation, while this thread waits for another thread."""
Submit = Callable[..., "Future[Any]"]
"""A function that runs another function, with given arguments, on a thread."""


class BuildCancelled(RuntimeError):
    """The build was cancelled, so that the result of a process is not needed."""


class CompilerProcesses:
    """The processes of one build. ended: whether the build was cancelled. After that, no process may start."""

    def __init__(self) -> None:
        self.ended = False
        self._lock = Lock()
        self._running: set[subprocess.Popen[bytes]] = set()

    def run(self, command: Sequence[str], env: Mapping[str, str]) -> tuple[int, str]:
        """Run a process to its end. Returns exit code and error output. Raises BuildCancelled if the build was cancelled."""
        with TemporaryFile("w+", errors="replace") as told:  # a file, because child processes would keep a pipe open
            with self._lock:
                if self.ended:
                    raise BuildCancelled
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
                raise BuildCancelled
            told.seek(0)
            return code, told.read()

    def end(self) -> None:
        """End all processes, and prevent the start of new processes."""
        with self._lock:
            self.ended = True
            for process in tuple(self._running):
                _kill(process)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a process. On systems with process groups, its child processes are ended, too."""
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
    process.wait()


_CURRENT: ContextVar[CompilerProcesses | None] = ContextVar("programs", default=None)


def run(command: Sequence[str], env: Mapping[str, str]) -> tuple[int, str]:
    """Run a process as part of the surrounding build. Outside a build, the process runs alone."""
    around = _CURRENT.get()
    if around is not None:
        return around.run(command, env)
    with side_by_side(1) as submit:
        found: tuple[int, str] = awaited(submit(run, command, env))
    return found


def awaited(work: Future[Any]) -> Any:
    """The result of work on another thread. The calling thread checks for interrupts while it waits. (A signal ends a plain wait
    only on some systems, and only the main thread receives signals.)"""
    from concurrent.futures import wait

    while not wait([work], LOOKS).done:
        heed()
    return work.result()


@contextmanager
def side_by_side(threads: int) -> Iterator[Submit]:
    """Work on several threads. A failure in the block, or Ctrl-C, ends the processes of all threads."""
    from concurrent.futures import ThreadPoolExecutor

    programs = CompilerProcesses()
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
