"""A queue of requests that read stored rows. At most READERS requests read at the same time. Callers take turns, so that large
reads do not delay small reads."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from typing import TypeVar

from fastapi.concurrency import run_in_threadpool

from trunnion.service.api.documents.problem_documents import shutting_down
from trunnion.service.request_workers.fair_queue import FairQueue

READERS = 3
"""Largest number of concurrent reads. One caller has at most READERS − 1 concurrent reads."""
T = TypeVar("T")


class ReadTurns(FairQueue[int]):
    """Gives turns to requests that read rows. Only for use in the event loop."""

    def __init__(self) -> None:
        super().__init__(range(READERS))

    async def run(self, who: str, work: Callable[[], T], begun: bool = False) -> T:
        """Run ``work`` on a thread when it is the caller's turn. QueueFull when too many requests wait. begun: whether the response
        has already started. A request with a started response is never refused."""
        try:
            slot = await self.take(who, begun)
        except asyncio.CancelledError:
            if begun:
                raise
            raise shutting_down() from None
        try:
            return await run_in_threadpool(work)
        finally:
            self.release(who, slot)

    async def stream(self, who: str, first: bytes, others: Iterator[bytes]) -> AsyncIterator[bytes]:
        """The pieces of a response. Each piece is created in its own turn, so that no turn is occupied while a slow client
        receives a piece."""
        piece: bytes | None = first
        while piece is not None:
            yield piece
            piece = await self.run(who, lambda: next(others, None), begun=True)
