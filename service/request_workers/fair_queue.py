"""A queue of requests for a few slots, which serves the callers in turn."""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Sequence
from typing import Generic, TypeVar

MOST_OF_CALLER, MOST = 64, 512
"""Largest numbers of waiting requests of one caller, and of all callers."""


Slot = TypeVar("Slot")


class QueueFull(RuntimeError):
    """Too many requests are waiting. own: whether all these requests are from the same caller."""

    def __init__(self, own: bool):
        super().__init__("too many of your requests are waiting" if own else "too many requests are waiting")
        self.own = own


class FairQueue(Generic[Slot]):
    """Slots, and the requests that wait for a slot. Callers get slots in turn. A caller never has all of several slots. Only for
    use in the event loop."""

    def __init__(self, places: Sequence[Slot]):
        self.count, self.free = len(places), list(places)
        self.waiting: OrderedDict[str, deque[asyncio.Future[Slot]]] = OrderedDict()
        self.busy: Counter[str] = Counter()

    def _may_take(self, who: str) -> bool:
        """Whether a caller may take one more slot. A caller may have at most max(1, count − 1) slots."""
        return self.busy[who] < max(1, self.count - 1)

    async def take(self, who: str, begun: bool = False) -> Slot:
        """Wait for a slot. QueueFull when too many requests wait, unless the response has already started (``begun``)."""
        if self.free and self._may_take(who):
            self.busy[who] += 1
            return self.free.pop()
        if not begun and len(self.waiting.get(who, ())) >= MOST_OF_CALLER:
            raise QueueFull(own=True)
        if not begun and sum(map(len, self.waiting.values())) >= MOST:
            raise QueueFull(own=False)
        place: asyncio.Future[Slot] = asyncio.get_running_loop().create_future()
        self.waiting.setdefault(who, deque()).append(place)
        try:
            return await place
        except asyncio.CancelledError:
            if place.done() and not place.cancelled():
                self.release(who, place.result())
            raise

    def release(self, who: str, place: Slot) -> None:
        """Return a slot to the queue. The next waiting caller that may take a slot gets this slot."""
        self.busy[who] -= 1
        if self.busy[who] <= 0:
            del self.busy[who]
        for next_ in list(self.waiting):
            if not self._may_take(next_):
                continue
            queue = self.waiting[next_]
            while queue:
                first = queue.popleft()
                if not first.done():
                    self._requeue(next_)
                    self.busy[next_] += 1
                    first.set_result(place)
                    return
            self._requeue(next_)
        self.free.append(place)

    def _requeue(self, who: str) -> None:
        """Move a caller to the end of the queue, or remove a caller without waiting requests."""
        if self.waiting[who]:
            self.waiting.move_to_end(who)
        else:
            del self.waiting[who]
