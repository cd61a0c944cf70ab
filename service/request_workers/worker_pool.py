"""A pool of worker processes, to which a fair queue distributes the requests."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from trunnion.basics.renamed_words import add_note
from trunnion.service.request_workers.fair_queue import FairQueue
from trunnion.service.request_workers.worker_process import Task, WorkerProcess


class WorkerPool(FairQueue[WorkerProcess]):
    """Worker processes, and the requests that wait for a worker. lasting: whether a worker serves several requests. Otherwise the
    worker ends after a request, which frees its memory. Only for use in the event loop."""

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
        NotReady, Ended, or the error that the task raised."""
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
