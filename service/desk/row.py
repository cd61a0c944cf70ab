"""Those who wait for one of a few places, and whose turn is next."""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Sequence
from typing import Generic, TypeVar

MOST_OF_ONE, MOST = 64, 512
"""Requests of one caller, and of all, that may wait."""


Place = TypeVar("Place")


class Crowded(RuntimeError):
    """Too many requests wait already. own: those of the caller."""

    def __init__(self, own: bool):
        super().__init__("too many of your requests wait already" if own else "too many requests wait already")
        self.own = own


class Row(Generic[Place]):
    """Places, and those who wait for one. Callers take turns, whatever number of requests each has sent, and nobody keeps all
    places busy at once. For the event loop."""

    def __init__(self, places: Sequence[Place]):
        self.count, self.free = len(places), list(places)
        self.waiting: OrderedDict[str, deque[asyncio.Future[Place]]] = OrderedDict()
        self.busy: Counter[str] = Counter()

    def _may(self, who: str) -> bool:
        """Whether a caller may have one more place: not the last one, where there are several."""
        return self.busy[who] < max(1, self.count - 1)

    async def take(self, who: str, begun: bool = False) -> Place:
        """Wait for a place. Crowded where too many wait; who has begun to be answered is never sent away."""
        if self.free and self._may(who):
            self.busy[who] += 1
            return self.free.pop()
        if not begun and len(self.waiting.get(who, ())) >= MOST_OF_ONE:
            raise Crowded(own=True)
        if not begun and sum(map(len, self.waiting.values())) >= MOST:
            raise Crowded(own=False)
        place: asyncio.Future[Place] = asyncio.get_running_loop().create_future()
        self.waiting.setdefault(who, deque()).append(place)
        try:
            return await place
        except asyncio.CancelledError:
            if place.done() and not place.cancelled():
                self.give(who, place.result())
            raise

    def give(self, who: str, place: Place) -> None:
        """A place is free: the next caller's turn."""
        self.busy[who] -= 1
        if self.busy[who] <= 0:
            del self.busy[who]
        for next_ in list(self.waiting):
            if not self._may(next_):
                continue
            queue = self.waiting[next_]
            while queue:
                first = queue.popleft()
                if not first.done():
                    self._queued_on(next_)
                    self.busy[next_] += 1
                    first.set_result(place)
                    return
            self._queued_on(next_)
        self.free.append(place)

    def _queued_on(self, who: str) -> None:
        """A caller who still waits goes to the end of the row."""
        if self.waiting[who]:
            self.waiting.move_to_end(who)
        else:
            del self.waiting[who]
