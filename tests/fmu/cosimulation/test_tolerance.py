"""Choice between the tolerances of host and FMU: the tighter tolerance counts, unless the user decides otherwise. The log reports
the choice."""

from __future__ import annotations

import pytest

from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
OWN, LOOSE, TIGHT = 1e-6, 1e-4, 1e-9


def swing(flavour: str, host_gives: float | None = None, **settings: float) -> list[list[float]]:
    """Example 8.1 up to its last reversals, with a tolerance that the host sets."""
    return Host(exported("spherical_pendulum", flavour), tolerance=host_gives, **settings).run(0.0, 20, 0.1, "ball.qd[2]")


@BOTH
def test_the_tighter_tolerance_counts(flavour: str) -> None:
    assert swing(flavour, LOOSE) == swing(flavour) == swing(flavour, OWN)
    assert swing(flavour, TIGHT) == swing(flavour, solver__tolerance=TIGHT) != swing(flavour)


@BOTH
def test_the_user_decides_whether_the_hosts_counts(flavour: str) -> None:
    assert swing(flavour, TIGHT, solver__host_tolerance=0) == swing(flavour)
    assert swing(flavour, LOOSE, solver__host_tolerance=2) == swing(flavour, solver__tolerance=LOOSE)


@BOTH
def test_the_log_names_the_tolerance_that_counts(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour), tolerance=LOOSE, logging=True)
    said = [text for status, text in host.log if "the run uses the tolerance" in text and status == 0]
    assert len(said) == 1
    assert "the run uses the tolerance 1e-06 of solver.tolerance, not 0.0001 of the host" in said[0]
