"""A debug build of the runtime checks whether the data that functions read belong to the current state
(``base/debug_validity_checks.h``)."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator

import numpy as np
import pytest

import trunnion
from tests.engine.checks.debug_runtime import in_place_of_the_runtime
from tests.reference.scenes.random_friction_scenes import rubbing
from trunnion.runtime.abi.enumerations import Status
from trunnion.scene import load_scene
from trunnion.simulation.execution.runnable_model import Model
from trunnion.simulation.runtime_interface import simulation_block as bl

STEPS = 150


@pytest.fixture
def debug() -> Iterator[ctypes.CDLL]:
    """The debug build in place of the runtime."""
    with in_place_of_the_runtime() as made:
        yield made


def running(scene: str) -> Model:
    """A scene's model at the start of a run of 5 s."""
    model, settings = Model(load_scene(scene), (), "parts"), bl.Settings()
    model.block.configure(settings)
    assert model.block.assemble() == 1
    assert model.begin(settings, 0.0, 5.0, 0.1, np.zeros(model.block.width)) == Status.OK
    return model


def failed(lib: ctypes.CDLL) -> tuple[int, bytes | None, bytes | None]:
    """Number of failed checks, and function and data of the first failed check."""
    function, part = ctypes.c_char_p(), ctypes.c_char_p()
    count = lib.tr_failed_check(ctypes.byref(function), ctypes.byref(part))
    return count, function.value, part.value


RUNS = [
    *((model, method) for model in ("spherical_pendulum", "crank_slider", "governor", "bricard") for method in ("auto", "rk5")),
    *((case, method) for case in (("tree", 3), ("loop", 3), ("loop", 8)) for method in ("auto", "rk8", "rosenbrock", "moreau")),
]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("scene", "method"), RUNS, ids=str)
def test_runs_read_nothing_of_another_state(scene: str | tuple[str, int], method: str, debug: ctypes.CDLL) -> None:
    given = scene if isinstance(scene, str) else rubbing(*scene).scene
    trunnion.simulate(given, method=method, kernel="parts", max_steps=STEPS)
    assert failed(debug) == (0, None, None)


def test_co_simulation_and_model_exchange_read_nothing_of_another_state(debug: ctypes.CDLL) -> None:
    model = running("spherical_pendulum")
    at, d, row = ctypes.c_void_p(model.block.at), ctypes.c_double, np.zeros(model.block.width)
    for i in range(1, 30):
        assert debug.tr_reach(at, d(0.1 * i), d(5.0), ctypes.c_long(1000), ctypes.c_void_p(row.ctypes.data)) == Status.DONE
        assert debug.tr_cut(at, d(0.1 * i)) == Status.OK
        assert debug.tr_resume(at, int(i == 10)) == Status.OK
    model.block.evaluate()
    assert debug.tr_verify(at, 0) == 0
    for name in ("tr_begin_exchange", "tr_rates_in_modes"):
        getattr(debug, name).restype = ctypes.c_void_p
        assert getattr(debug, name)(at)
    changed = ctypes.c_int()
    assert debug.tr_update(at, 1, ctypes.byref(changed)) == Status.OK
    assert debug.tr_completed(at) == 0
    assert debug.tr_roots(at) == 1
    assert failed(debug) == (0, None, None)


def test_analyses_of_a_state_read_no_values_of_another_state(debug: ctypes.CDLL) -> None:
    trunnion.hold("spherical_pendulum")
    trunnion.linearize("crank_slider")
    assert failed(debug) == (0, None, None)


def test_a_function_that_reads_what_is_not_there_is_named(debug: ctypes.CDLL) -> None:
    model = running("spherical_pendulum")
    debug.tr_wrong(ctypes.c_void_p(model.block.at))
    assert failed(debug) == (1, b"tr_friction_ratio", b"TR_HAS_CAPACITY")
