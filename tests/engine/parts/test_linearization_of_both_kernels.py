"""The parts kernel and the compiled kernel have the same linearization: derivatives of rates and columns with respect to inputs and
states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.engine.parts.test_compiled_kernel_equivalence import ROUND_OFF, State, called, loop, tree
from trunnion.kernel.interface.output_columns import columns
from trunnion.runtime.abi.kernel_records import KERNEL, LINEAR
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model
from trunnion.system.construction.system_builder import build


def models(scene: Scene) -> list[Model]:
    """Compiled models and models of parts, with columns of all kinds except contacts. The ratio of contacts at rest has no bound at
    states with random friction."""
    names = [c.name for c in columns(build(scene).system) if ".contact[" not in c.name]
    return [Model(scene, names, kernel) for kernel in ("compiled", "parts")]


def state_of(model: Model) -> State:
    """Random numbers for the model's functions, with integrals after the states."""
    made = State(model.built, KERNEL.ctype.from_address(model.kernel.address("kernel")), 1)
    made.y = np.concatenate([made.y, np.zeros(40)])
    return made


def same(found: np.ndarray, expected: np.ndarray) -> None:
    """Check that numbers are equal up to the order of sums."""
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUND_OFF * max(np.abs(expected).max(initial=0.0), 1e-3))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("make", [tree, loop])
def test_linear_units_agree(make: Callable[[int], Scene]) -> None:
    both = models(make(1))
    s, seed = state_of(both[1]), np.random.default_rng(5).normal(size=400)
    written = [_linear(m, s, seed) for m in both]
    for found, expected in zip(*reversed(written), strict=True):
        same(found, expected)


def _linear(model: Model, s: State, seed: np.ndarray) -> list[np.ndarray]:
    """The numbers that a linear unit writes for rates and columns."""
    unit: Any = LINEAR.ctype.from_address(model.kernel.linear(model.columns))
    c, z, sizes = np.zeros(unit.nc + 1), np.random.default_rng(6).normal(size=100), model.kernel.sizes
    rates, shown = np.zeros(model.block.ny + sizes["active"] + sizes["neta"] + 1), np.zeros(len(model.columns) + 1)
    called(unit, "prepare", s.p, c)
    called(unit, "rates", s.x, s.y, c, s.z, seed, rates)
    called(unit, "columns", s.x, s.y, c, z, z[50:].copy(), seed, shown)
    return [rates[:-1], shown[:-1]]
