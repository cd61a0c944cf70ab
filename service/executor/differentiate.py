"""What a Dask worker does for ``POST /v1/sensitivities``: one run and its derivatives, within its time."""

from __future__ import annotations

import time
from typing import Any

from engine.basics.problems import Problem, SceneError
from engine.scene.load import scene_from_dict
from service.executor.work import Cancelled
from service.plain import text_of

LOOK_SECONDS = 0.25


def run_sensitivity(asked: dict[str, Any], seconds: float) -> bytes:
    """Values and derivatives as JSON. asked: the scene as plain data and the other arguments of ``engine.sensitivity``. SceneError
    when the work takes longer than ``seconds``, Cancelled when nobody waits for the answer any more."""
    from engine.sensitivities import sensitivity

    scene = scene_from_dict(asked.pop("scene"))
    return text_of(sensitivity(scene, **asked, tick=_Watch(seconds)).document())


class _Watch:
    """Called at least once in every step; ends the run by an exception when it is out of time or no longer wanted."""

    def __init__(self, seconds: float):
        self.seconds, self.end = seconds, time.monotonic() + seconds
        self.looked = time.monotonic()

    def __call__(self) -> None:
        now = time.monotonic()
        if now > self.end:
            raise SceneError([out_of_time(self.seconds)])
        if now - self.looked > LOOK_SECONDS:
            self.looked = now
            if not _wanted():
                raise Cancelled("nobody waits for it any more")


def out_of_time(seconds: float) -> Problem:
    """The problem of a request that took too long."""
    hint = "a shorter run, larger rtol, fewer parameters or more budget; what was compiled is kept: asking again is faster"
    return Problem("budget", f"the time budget of {seconds:g} s is used up", hint)


def _wanted() -> bool:
    """Whether the task this thread works on has not been cancelled."""
    from distributed import get_worker

    worker = get_worker()
    task = worker.state.tasks.get(worker.get_current_task())
    return task is not None and task.state != "cancelled"
