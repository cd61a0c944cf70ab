"""The function that Dask workers run for ``POST /v1/sensitivities``. It computes a run with derivatives, within a time limit."""

from __future__ import annotations

import time
from typing import Any

from trunnion.basics.interrupts import watched
from trunnion.basics.problems import Problem, SceneError
from trunnion.scene.scene_loader import scene_from_dict
from trunnion.service.basics.json_text import text_of
from trunnion.service.executor.chunk_and_case_runs import RequestMonitor


def run_sensitivity(asked: dict[str, Any], seconds: float) -> bytes:
    """JSON of the values and derivatives. asked: the scene as plain data, and the other arguments of ``trunnion.sensitivity``.
    Raises SceneError when the computation takes more than ``seconds``, and Cancelled when the client has disconnected."""
    from trunnion.analysis.sensitivities.output_derivatives import sensitivity

    scene = scene_from_dict(asked.pop("scene"))
    check = _TimedMonitor(seconds).check
    with watched(check):
        return text_of(sensitivity(scene, **asked, tick=check).document())


class _TimedMonitor(RequestMonitor):
    """Raises SceneError when the time is used up, and Cancelled when the client has disconnected. It is called in every step and
    during building."""

    def __init__(self, seconds: float):
        super().__init__()
        self.seconds, self.end = seconds, time.monotonic() + seconds

    def check(self) -> None:
        if time.monotonic() > self.end:
            hint = "request a shorter run, larger rtol, fewer parameters or a larger budget; a second request is faster"
            raise SceneError([Problem("budget", f"the time budget of {self.seconds:g} s is used up", hint)])
        super().check()
