"""Worker processes, and a pool of worker processes. A worker reads and checks requests one after another, within limits of time and
memory. A fair queue distributes the requests to the workers of the pool."""

from __future__ import annotations

import asyncio
import importlib
import logging
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from trunnion.basics.errors import SceneError, SimulationError
from trunnion.basics.renamed_words import add_note, deprecation_notes
from trunnion.service.request_workers.fair_queue import FairQueue

log = logging.getLogger("trunnion.service")
Task = Callable[..., Any]
START_SECONDS = 60.0
"""Longest time until a process is ready, s, even on a busy machine. This time does not count as time of the request."""
NICE = 5
"""Increase of the niceness of the process relative to the server."""
ANSWER_ERRORS = (SceneError, SimulationError, ImportError)
"""Errors of a task that the process returns to the server. The server raises these errors again."""
READY = "ready"
"""The first message that the process sends."""
TASK_MODULE = "trunnion.service.request_workers.rerun_and_extend_plans"
"""Importing this module imports all tasks."""


class TookTooLong(RuntimeError):
    """The request exceeded its time limit."""


class NotReady(RuntimeError):
    """The process did not start in time; a retry can succeed."""


class ProcessEnded(RuntimeError):
    """The process ended during a request, for example because the process exceeded its memory."""


class Defect(RuntimeError):
    """The request triggered a defect of the program. The server logs the defect."""


def serve_tasks(connection: Connection, memory: int) -> None:
    """The main function of a worker process. The function sends READY. The function then answers each message (task, arguments)
    with (success, result or error, notes about deprecated words), until the connection closes."""
    _isolate()
    _limit_memory(memory)
    importlib.import_module(TASK_MODULE)  # not during the first request; a forked process has imported the tasks
    connection.send(READY)
    while True:
        try:
            task, arguments = connection.recv()
        except (EOFError, OSError):
            return
        try:
            with deprecation_notes() as notes:
                answer = True, task(*arguments)
        except ANSWER_ERRORS as e:
            answer = False, e
        except MemoryError:
            answer = False, ProcessEnded("the request needs more memory than allowed")
        except Exception as e:  # noqa: BLE001  # the server logs the defect
            answer = False, Defect(f"{type(e).__name__}\n{traceback.format_exc()}")
        connection.send((*answer, notes))


def _isolate() -> None:
    """Make this process the leader of a process group and lower its priority. The process ends when its parent has ended."""
    with suppress(AttributeError, OSError):
        os.setsid()
        os.nice(NICE)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    server = multiprocessing.parent_process()
    assert server is not None

    def watch() -> None:
        server.join()
        _end_group(os.getpid())

    threading.Thread(target=watch, daemon=True).start()


def _limit_memory(memory: int) -> None:
    """Limit the size of the address space, in bytes, on systems with such a limit."""
    try:
        import resource
    except ImportError:
        return
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


def _end_group(leader: int) -> None:
    """Kill the processes in the group of a leader."""
    with suppress(AttributeError, OSError):
        os.killpg(leader, signal.SIGKILL)


def process_context() -> Any:
    """The context that starts processes. On Linux, a process without threads imports the tasks once, and worker processes are
    forked from it in milliseconds. On other systems, each worker process imports the tasks, which takes a second."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([TASK_MODULE])
    return context


class WorkerProcess:
    """The server's handle of a worker process. Only ``start`` and ``end`` may be called from several threads."""

    def __init__(self, memory: int):
        self.memory = memory
        self.process: Any = None
        self.connection: Any = None
        self.ready = False
        self.starting = threading.Lock()

    def start(self) -> None:
        """Start the process, unless it is running."""
        with self.starting:
            self._start()

    def _start(self) -> None:
        if self.process is not None and self.process.is_alive():
            return
        context = process_context()
        self.connection, theirs = context.Pipe()
        self.ready = False
        self.process = context.Process(target=serve_tasks, args=(theirs, self.memory), daemon=True, name="trunnion-worker")
        self.process.start()
        theirs.close()

    def run_task(self, task: Task, arguments: tuple[Any, ...], seconds: float) -> tuple[Any, list[str]]:
        """The result of a task, and notes about deprecated words. Raises the error that the task raised. Raises TookTooLong when
        the task exceeded ``seconds``, ProcessEnded when the process ended, and NotReady when the process did not start in time."""
        self.start()
        connection = self.connection
        try:
            self._wait_until_ready(connection)
            connection.send((task, arguments))
            if not connection.poll(seconds):
                raise TookTooLong(f"the request took longer than the {seconds:g} s allowed")
            good, answer, notes = connection.recv()
        except (EOFError, OSError) as e:
            self.end()
            raise ProcessEnded("the worker process ran out of memory and ended during the request") from e
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
        """Kill the process and its descendants. A process that another thread is starting is killed after its start."""
        with self.starting:
            if self.process is not None:
                _end_group(self.process.pid)
                self.process.kill()
                self.process.join(1)


class WorkerPool(FairQueue[WorkerProcess]):
    """Worker processes, and the requests that wait for a worker. lasting: whether a worker serves several requests. Otherwise the
    worker ends after a request, and its end frees the memory. Only for use in the event loop."""

    def __init__(self, workers: int, memory: float, lasting: bool = True):
        self.workers = [WorkerProcess(int(memory)) for _ in range(workers)]
        self.lasting = lasting
        super().__init__(self.workers)
        self.pool = ThreadPoolExecutor(workers, thread_name_prefix="worker-pool")

    def start(self) -> None:
        """Start the workers on a thread, so that the first request does not wait for them."""

        def started() -> None:
            for worker in self.workers:
                worker.start()

        threading.Thread(target=started, daemon=True).start()

    async def ask(self, who: str, task: Task, *arguments: Any, seconds: float) -> Any:
        """The result of a task for the caller ``who``. Deprecated words in the request become notes. Raises QueueFull, TookTooLong,
        NotReady, ProcessEnded, or the error that the task raised."""
        worker = await self.take(who)
        try:
            answer, notes = await asyncio.get_running_loop().run_in_executor(self.pool, worker.run_task, task, arguments, seconds)
        except asyncio.CancelledError:
            worker.end()
            raise
        finally:
            if not self.lasting:
                worker.end()
            self.release(who, worker)
        for note in notes:
            add_note(note)
        return answer

    def close(self) -> None:
        for worker in self.workers:
            worker.end()
        self.pool.shutdown(wait=False, cancel_futures=True)
