"""Requests whose result the cluster computes. A waiting request occupies no thread. A request is cancelled when its client
disconnects."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import Any

from fastapi import Request
from fastapi.concurrency import run_in_threadpool

from trunnion.service.api.documents.problem_documents import Refusal, shutting_down
from trunnion.service.api.server_state.server_components import Service, Turns
from trunnion.service.executor.dask_cluster import NoCluster

MOST_WAITING = 32
GONE = ("cancelled", "lost")
LOOK_SECONDS = 0.25
TURN_SECONDS = 0.05
RESULT_SECONDS = 10


@asynccontextmanager
async def take_turn(turns: Turns, most: int) -> AsyncIterator[None]:
    """Wait for one of ``most`` concurrent turns. Refusal (503) when too many requests wait."""
    if turns.there >= MOST_WAITING:
        raise Refusal(503, "too many requests of this kind are waiting; try again", headers={"Retry-After": "10"})
    turns.there += 1
    try:
        while turns.busy >= most:
            await asyncio.sleep(TURN_SECONDS)
        turns.busy += 1
        try:
            yield
        finally:
            turns.busy -= 1
    finally:
        turns.there -= 1


async def call_cluster(
    s: Service, request: Request, seconds: float, turns: Turns, most: int, work: Callable[..., Any], *given: Any, priority: int = 0
) -> bytes:
    """The result of a function that runs on the cluster. work, given: the function and its arguments. Refusal (503) when too many
    calls wait, or when there is no result after ``seconds``. most: largest number of concurrent calls. priority: calls with a
    priority above 0 run before the chunks of jobs, whose priority is 0."""
    end = time.monotonic() + seconds
    call = asyncio.create_task(_run_call(turns, most, lambda: s.cluster.submit(work, *given, priority=priority)))
    try:
        while not call.done():
            await asyncio.wait({call}, timeout=LOOK_SECONDS)
            if not call.done() and (time.monotonic() > end or await request.is_disconnected()):
                raise Refusal(503, f"there was no answer within {seconds:g} s", headers={"Retry-After": "60"})
        return call.result()
    except asyncio.CancelledError:
        raise shutting_down() from None
    finally:
        call.cancel()


async def _run_call(turns: Turns, most: int, submit: Callable[[], Any]) -> bytes:
    """Wait for a turn, then call the function on the cluster. If this task is cancelled, the call on the cluster is also
    cancelled."""
    async with take_turn(turns, most):
        future = await run_in_threadpool(submit)
        loop, over = asyncio.get_running_loop(), asyncio.Event()

        def came(_: Any) -> None:
            with suppress(RuntimeError):  # the event loop is already closed when the server ends
                loop.call_soon_threadsafe(over.set)

        future.add_done_callback(came)
        try:
            while not over.is_set() and future.status not in GONE:
                with suppress(TimeoutError):
                    await asyncio.wait_for(over.wait(), LOOK_SECONDS)
            return bytes(await run_in_threadpool(_result, future))
        finally:
            if not future.done():
                loop.run_in_executor(None, future.cancel)


def _result(future: Any) -> Any:
    """The result of a future. Raises the error that the called function raised, or NoCluster when the worker was lost."""
    from distributed import KilledWorker

    error = future.exception(timeout=RESULT_SECONDS) if future.status == "error" else None
    if isinstance(error, KilledWorker):
        raise NoCluster("the worker process ended repeatedly")
    if error is not None:
        raise error
    if future.status != "finished":
        raise NoCluster("the cluster was lost")
    return future.result(timeout=RESULT_SECONDS)
