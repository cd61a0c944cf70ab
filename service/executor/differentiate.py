"""What a Dask worker does for ``POST /v1/sensitivities``: one run and its derivatives, within its time."""

from __future__ import annotations

import time
from typing import Any

from engine.basics.interrupts import watched
from engine.basics.problems import Problem, SceneError
from engine.scene.load import scene_from_dict
from service.executor.work import Wanted
from service.plain import text_of


def run_sensitivity(asked: dict[str, Any], seconds: float) -> bytes:
    """Values and derivatives as JSON. asked: the scene as plain data and the other arguments of ``engine.sensitivity``. SceneError
    when the work takes longer than ``seconds``, Cancelled when nobody waits for the answer any more."""
    from engine.sensitivities import sensitivity

    scene = scene_from_dict(asked.pop("scene"))
    look = _Watch(seconds).look
    with watched(look):
        return text_of(sensitivity(scene, **asked, tick=look).document())


class _Watch(Wanted):
    """Called at least once in every step, and while it builds; ends the run by an exception when it is out of time or no longer
    wanted."""

    def __init__(self, seconds: float):
        super().__init__()
        self.seconds, self.end = seconds, time.monotonic() + seconds

    def look(self) -> None:
        """Raise when it is time to."""
        if time.monotonic() > self.end:
            raise SceneError([out_of_time(self.seconds)])
        super().look()


def out_of_time(seconds: float) -> Problem:
    """The problem of a request that took too long."""
    hint = "a shorter run, larger rtol, fewer parameters or more budget; what was compiled is kept: asking again is faster"
    return Problem("budget", f"the time budget of {seconds:g} s is used up", hint)

