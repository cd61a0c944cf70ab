"""A process that reads and checks requests one after another, within limits of time and memory."""

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

from trunnion.basics.problems import SceneError, SimulationError
from trunnion.basics.renamed_words import deprecation_notes

log = logging.getLogger("trunnion.service")
ORPHAN_SECONDS = 1.0
START_SECONDS = 60.0
"""Seconds in which the process must be ready, even on a busy machine. They do not count as time of the request."""
NICE = 5
"""Niceness of the process relative to the server."""
ANSWER_ERRORS = (SceneError, SimulationError, ImportError)
"""Errors that are returned as results; the server raises them again."""
READY = "ready"
"""First message of the process."""


class TookTooLong(RuntimeError):
    """The request exceeded its time."""


class NotReady(RuntimeError):
    """The process did not start in time; a retry can succeed."""


class Ended(RuntimeError):
    """The process ended during a request, for example when it exceeded its memory."""


class Defect(RuntimeError):
    """The request triggered a defect, which the log describes."""


def serve_tasks(connection: Connection, memory: int, parent: int) -> None:
    """Main function of the process. Sends READY, then answers each (task name, arguments) with (success, result or error, notes
    about deprecated words) until the connection closes."""
    _isolate(parent)
    _limit_memory(memory)
    import trunnion.service.request_workers.rerun_and_extend_plans  # noqa: F401  # its tasks are offered, too
    from trunnion.service.request_workers.worker_tasks import TASKS

    connection.send(READY)
    while True:
        try:
            name, arguments = connection.recv()
        except (EOFError, OSError):
            return
        try:
            with deprecation_notes() as notes:
                answer = True, TASKS[name](*arguments)
        except ANSWER_ERRORS as e:
            answer = False, e
        except MemoryError:
            answer = False, Ended("the request needs more memory than allowed")
        except Exception as e:  # noqa: BLE001  # the server says which defect it was
            answer = False, Defect(f"{type(e).__name__}\n{traceback.format_exc()}")
        connection.send((*answer, notes))


def _isolate(parent: int) -> None:
    """Lead a process group, lower the priority, and end when the parent has ended."""
    with suppress(AttributeError, OSError):
        os.setsid()
        os.nice(NICE)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(ORPHAN_SECONDS)
        _end_group(os.getpid())

    if hasattr(os, "getppid"):
        threading.Thread(target=watch, daemon=True).start()


def _limit_memory(memory: int) -> None:
    """Limit the address space, bytes, on systems that can."""
    try:
        import resource
    except ImportError:
        return
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


def _end_group(leader: int) -> None:
    """End a process and its descendants."""
    with suppress(AttributeError, OSError):
        os.killpg(leader, signal.SIGKILL)


class WorkerProcess:
    """A worker process as the server sees it. Only ``start`` and ``end`` may be called from several threads."""

    def __init__(self, memory: int):
        self.memory = memory
        self.process: Any = None
        self.connection: Any = None
        self.ready = False
        self.starting = threading.Lock()

    def start(self) -> None:
        """Start the process unless it runs."""
        with self.starting:
            self._start()

    def _start(self) -> None:
        if self.process is not None and self.process.is_alive():
            return
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.ready = False
        self.process = context.Process(
            target=serve_tasks, args=(theirs, self.memory, os.getpid()), daemon=True, name="trunnion-worker"
        )
        self.process.start()
        theirs.close()

    def run_task(self, name: str, arguments: tuple[Any, ...], seconds: float) -> tuple[Any, list[str]]:
        """(result of a task, notes about deprecated words), or the task's error. Raises TookTooLong or Ended when the process had
        to be ended or has ended, NotReady when it did not start in time."""
        self.start()
        connection = self.connection
        try:
            self._wait_until_ready(connection)
            connection.send((name, arguments))
            if not connection.poll(seconds):
                raise TookTooLong(f"the request took longer than the {seconds:g} s allowed")
            good, answer, notes = connection.recv()
        except (EOFError, OSError) as e:
            self.end()
            raise Ended("the process ended while it worked on the request: it ran out of memory") from e
        except (TookTooLong, NotReady):
            self.end()
            raise
        if good:
            return answer, notes
        if isinstance(answer, Defect):
            log.error("internal error: %s", answer)
        raise answer

    def _wait_until_ready(self, connection: Connection) -> None:
        if self.ready:
            return
        if not connection.poll(START_SECONDS):
            raise NotReady("the checking process did not start in time: the machine is busy; try again")
        self.ready = connection.recv() == READY

    def end(self) -> None:
        """End the process and its descendants at once."""
        if self.process is not None:
            _end_group(self.process.pid)
            self.process.kill()
            self.process.join(1)
