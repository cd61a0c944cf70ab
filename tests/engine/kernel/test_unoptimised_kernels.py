"""Kernels that are compiled without optimisation compute the same values as optimised kernels, up to round-off."""

from __future__ import annotations

import numpy as np
import pytest

from trunnion.kernel.compilation import c_compiler
from trunnion.simulation.run import simulate

ROUND_OFF = 1e-10
"""Allowed difference relative to the largest value of the same unit. The compiler groups operations in another order, and
multipliers come from Newton's method."""


@pytest.mark.parametrize("name", ["spherical_pendulum", "crank_slider_free"])
def test_every_column_of_a_state_is_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The test compares the state at the start, before any integration: coordinates, accelerations, reactions, contacts,
    energies."""
    rows = {}
    for quick in ("0", "1"):
        monkeypatch.setenv("TRUNNION_QUICK_BUILD", quick)
        assert c_compiler.quick() == (quick == "1")
        rows[quick] = simulate(name, until=1e-3, every=1e-3)
    units = np.array(list(rows["0"].units.values()))
    optimised, quickly = (rows[q].data[0] for q in ("0", "1"))
    for unit in set(units):
        here = units == unit
        most = ROUND_OFF * max(1.0, np.abs(optimised[here]).max())
        assert np.allclose(quickly[here], optimised[here], rtol=0, atol=most, equal_nan=True)
