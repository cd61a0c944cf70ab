"""An FMU warns its host of an energy error in the run. It gives one warning, with time and joint, and the run continues."""

from __future__ import annotations

import pytest

from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
WARNING = 1


def told(host: Host) -> list[str]:
    """The FMU's messages about the audit."""
    return [text for _, text in host.log if "audit" in text]


@BOTH
def test_energy_that_is_lost_is_warned_of_once_with_its_time(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour), **{"joints.ball.friction.mu": 0.0, "solver.tolerance": 0.1})
    host.run(0.0, 400, 0.025)
    said = [line for line in told(host) if "inaccurate" in line]
    assert len(said) == 1
    assert "audit at t = " in said[0]
    assert "J turned over" in said[0]


@BOTH
def test_a_correct_run_gives_no_warning(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour))
    host.run(0.0, 100, 0.02)
    assert told(host) == []
