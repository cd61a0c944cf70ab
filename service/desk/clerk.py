"""A process that reads and checks requests, one after another. It is ended when it takes too long, and gets only so much memory."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import time
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from engine.basics.problems import SceneError, SimulationError

log = logging.getLogger("trunnion.service")
ORPHAN_SECONDS = 1.0
STARTING = 60.0
"""Seconds that a process may take until it is ready, on a machine however busy: they are not the time of the request."""
GIVES_WAY = 5
"""How much less of a busy machine it gets than the server, in steps of nice."""
PASSED_ON = (SceneError, SimulationError, ImportError)
"""Errors that are answers: they are raised again where the request came in."""
READY = "ready"
"""What the process says first."""


class TookTooLong(RuntimeError):
    """A request was given up."""


class NotReady(RuntimeError):
    """There is no process to work on a request now; trying again later is right."""


class Ended(RuntimeError):
    """The process ended while it worked on a request: it needed more memory than it gets."""


class Defect(RuntimeError):
    """A request brought out a defect; what went wrong is in the log."""


def work(connection: Connection, memory: int, parent: int) -> None:
    """What the process does until its connection ends: say that it is ready, then answer (task's name, arguments) with (whether it
    could, result or error)."""
    _alone(parent)
    _bounded(memory)
    import service.desk.following  # noqa: F401  # its tasks are offered, too
    from service.desk.tasks import TASKS

    connection.send(READY)
    while True:
        try:
            name, arguments = connection.recv()
        except (EOFError, OSError):
            return
        try:
            answer = True, TASKS[name](*arguments)
        except PASSED_ON as e:
            answer = False, e
        except MemoryError:
            answer = False, Ended("it needs more memory than a request gets")
        except Exception as e:  # noqa: BLE001  # the server says which defect it was
            answer = False, Defect(f"{type(e).__name__}\n{traceback.format_exc()}")
        connection.send(answer)


def _alone(parent: int) -> None:
    """Be a group of its own, which can be ended with all it has started, give way to the server, and end when that is gone."""
    with suppress(AttributeError, OSError):
        os.setsid()
        os.nice(GIVES_WAY)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(ORPHAN_SECONDS)
        _end_group(os.getpid())

    if hasattr(os, "getppid"):
        threading.Thread(target=watch, daemon=True).start()


def _bounded(memory: int) -> None:
    """Let the process have no more address space than this, bytes, where the system can do that."""
    try:
        import resource
    except ImportError:
        return
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


def _end_group(leader: int) -> None:
    """End a process and all that it has started."""
    with suppress(AttributeError, OSError):
        os.killpg(leader, signal.SIGKILL)


class Clerk:
    """A process as the server sees it. For one thread at a time, but for ``start`` and ``end``."""

    def __init__(self, memory: int):
        self.memory = memory
        self.process: Any = None
        self.connection: Any = None
        self.ready = False
        self.starting = threading.Lock()

    def start(self) -> None:
        """Start the process, if it is not running."""
        with self.starting:
            self._start()

    def _start(self) -> None:
        if self.process is not None and self.process.is_alive():
            return
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.ready = False
        self.process = context.Process(target=work, args=(theirs, self.memory, os.getpid()), daemon=True, name="clerk")
        self.process.start()
        theirs.close()

    def ask(self, name: str, arguments: tuple[Any, ...], seconds: float) -> Any:
        """The result of a task, or its error; TookTooLong or Ended when the process had to be ended, or has ended, NotReady when it
        could not be started in time."""
        self.start()
        connection = self.connection
        try:
            self._wait(connection)
            connection.send((name, arguments))
            if not connection.poll(seconds):
                raise TookTooLong(f"it took longer than the {seconds:g} s that a request gets")
            good, answer = connection.recv()
        except (EOFError, OSError) as e:
            self.end()
            raise Ended("the process that worked on it has ended") from e
        except (TookTooLong, NotReady):
            self.end()
            raise
        if good:
            return answer
        if isinstance(answer, Defect):
            log.error("internal error: %s", answer)
        raise answer

    def _wait(self, connection: Connection) -> None:
        """Wait until the process is ready."""
        if self.ready:
            return
        if not connection.poll(STARTING):
            raise NotReady("the process that reads requests could not be started: the machine is too busy")
        self.ready = connection.recv() == READY

    def end(self) -> None:
        """End the process at once, with all it has started."""
        if self.process is not None:
            _end_group(self.process.pid)
            self.process.kill()
            self.process.join(1)
