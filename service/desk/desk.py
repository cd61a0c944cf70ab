"""Who is served when: a fair queue of requests before a few clerks."""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from service.desk.clerk import Clerk
from service.desk.row import Row


class Desk(Row[Clerk]):
    """Clerks and those who wait for one. lasting: whether a clerk goes on after a request, or gives all its memory back. For the
    event loop."""

    def __init__(self, clerks: int, memory: float, lasting: bool = True):
        self.clerks = [Clerk(int(memory)) for _ in range(clerks)]
        self.lasting = lasting
        super().__init__(self.clerks)
        self.pool = ThreadPoolExecutor(clerks, thread_name_prefix="desk")

    def start(self) -> None:
        """Start the clerks, on a thread of its own: the first request need not wait for them."""

        def started() -> None:
            for clerk in self.clerks:
                clerk.start()

        threading.Thread(target=started, daemon=True).start()

    async def ask(self, who: str, name: str, *arguments: Any, seconds: float) -> Any:
        """The result of a task for a caller; Crowded, TookTooLong, Ended, or the task's own error."""
        clerk = await self.take(who)
        try:
            return await asyncio.get_running_loop().run_in_executor(self.pool, clerk.ask, name, arguments, seconds)
        except asyncio.CancelledError:
            clerk.end()
            raise
        finally:
            if not self.lasting:
                clerk.end()
            self.give(who, clerk)

    def close(self) -> None:
        """End all clerks."""
        for clerk in self.clerks:
            clerk.end()
        self.pool.shutdown(wait=False, cancel_futures=True)
