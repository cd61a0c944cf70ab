"""Who is served when: a fair queue of requests before a few clerks."""

from __future__ import annotations

import asyncio
import threading
from collections import Counter, OrderedDict, deque
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from service.desk.clerk import Clerk

MOST_OF_ONE, MOST = 64, 512
"""Requests of one caller, and of all, that may wait."""


class Crowded(RuntimeError):
    """Too many requests wait already. own: those of the caller."""

    def __init__(self, own: bool):
        super().__init__("too many of your requests wait already" if own else "too many requests wait already")
        self.own = own


class Desk:
    """Clerks and those who wait for one. Callers take turns, whatever number of requests each has sent, and nobody keeps all clerks
    busy at once. lasting: whether a clerk goes on after a request, or gives all its memory back. For the event loop."""

    def __init__(self, clerks: int, memory: float, lasting: bool = True):
        self.clerks = [Clerk(int(memory)) for _ in range(clerks)]
        self.free, self.lasting = list(self.clerks), lasting
        self.waiting: OrderedDict[str, deque[asyncio.Future[Clerk]]] = OrderedDict()
        self.busy: Counter[str] = Counter()
        self.pool = ThreadPoolExecutor(clerks, thread_name_prefix="desk")

    def start(self) -> None:
        """Start the clerks, on a thread of its own: the first request need not wait for them."""

        def started() -> None:
            for clerk in self.clerks:
                clerk.start()

        threading.Thread(target=started, daemon=True).start()

    async def ask(self, who: str, name: str, *arguments: Any, seconds: float) -> Any:
        """The result of a task for a caller; Crowded, TookTooLong, Ended, or the task's own error."""
        clerk = await self._turn(who)
        try:
            return await asyncio.get_running_loop().run_in_executor(self.pool, clerk.ask, name, arguments, seconds)
        except asyncio.CancelledError:
            clerk.end()
            raise
        finally:
            if not self.lasting:
                clerk.end()
            self._over(who, clerk)

    def _may(self, who: str) -> bool:
        """Whether a caller may have one more clerk: not the last one, where there are several."""
        return self.busy[who] < max(1, len(self.clerks) - 1)

    async def _turn(self, who: str) -> Clerk:
        """Wait for a clerk."""
        if self.free and self._may(who):
            self.busy[who] += 1
            return self.free.pop()
        if len(self.waiting.get(who, ())) >= MOST_OF_ONE:
            raise Crowded(own=True)
        if sum(map(len, self.waiting.values())) >= MOST:
            raise Crowded(own=False)
        place: asyncio.Future[Clerk] = asyncio.get_running_loop().create_future()
        self.waiting.setdefault(who, deque()).append(place)
        try:
            return await place
        except asyncio.CancelledError:
            if place.done() and not place.cancelled():
                self._over(who, place.result())
            raise

    def _over(self, who: str, clerk: Clerk) -> None:
        """A clerk is free: the next caller's turn."""
        self.busy[who] -= 1
        if self.busy[who] <= 0:
            del self.busy[who]
        for next_ in list(self.waiting):
            if not self._may(next_):
                continue
            queue = self.waiting[next_]
            while queue:
                place = queue.popleft()
                if not place.done():
                    self._queued_on(next_)
                    self.busy[next_] += 1
                    place.set_result(clerk)
                    return
            self._queued_on(next_)
        self.free.append(clerk)

    def _queued_on(self, who: str) -> None:
        """A caller who still waits goes to the end of the row."""
        if self.waiting[who]:
            self.waiting.move_to_end(who)
        else:
            del self.waiting[who]

    def close(self) -> None:
        """End all clerks."""
        for clerk in self.clerks:
            clerk.end()
        self.pool.shutdown(wait=False, cancel_futures=True)
