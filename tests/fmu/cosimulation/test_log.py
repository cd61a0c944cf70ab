"""The log that a host requests. It contains, by category, every event at its own time, and the begin, progress and end of the
run."""

from __future__ import annotations

import re

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

import trunnion
from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
STEPS, H = 40, 0.1


@BOTH
def test_every_event_is_reported_with_its_joint_at_its_own_time(flavour: str) -> None:
    """The events are the engine's events, to 0.01 µs."""
    events = trunnion.simulate("spherical_pendulum", until=1.1 * STEPS * H, every=H).events
    host = Host(exported("spherical_pendulum", flavour), logging=True)
    host.run(0.0, STEPS, H)
    found = [re.fullmatch(r"event at t = (\S+) s: (.*) in joint (.*)", text) for _, text in host.log]
    told = [(float(m[1]), m[2], m[3]) for m in found if m]
    due = [(e.time, e.kind.replace("_", " "), e.joint) for e in events if e.time <= told[-1][0] + 1e-6]
    assert len(told) >= 3
    assert [t[1:] for t in told] == [t[1:] for t in due]
    assert np.allclose([t[0] for t in told], [t[0] for t in due], rtol=0, atol=1e-8)


@BOTH
def test_the_run_reports_how_it_proceeds(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour), stop=STEPS * H, logging=True)
    host.run(0.0, STEPS, H)
    host.fmu.terminate()
    said = [text for _, text in host.log if "event at" not in text]
    assert said[0] == "the run begins at t = 0 s: tolerance 1e-06, error control"
    assert [int(text.split(", ")[1].split()[0]) for text in said[1:-1]] == list(range(10, 110, 10))
    assert said[-1].startswith("the run ends at t = 4 s: ")


@BOTH
def test_the_log_has_the_categories_that_the_host_asked_for(flavour: str) -> None:
    host = Host(exported("spherical_pendulum", flavour))
    host.run(0.0, 5, H)
    assert host.log == []
    host.fmu.setDebugLogging(True, ["logEvents"])
    for k in range(5, STEPS):
        host.fmu.doStep(k * H, H)
    assert host.log
    assert all(text.startswith("event at") for _, text in host.log)
    host.fmu.setDebugLogging(False, [])
    host.log.clear()
    host.run(STEPS * H, 20, H)
    assert host.log == []
    with pytest.raises(FMICallException):
        host.fmu.setDebugLogging(True, ["logGossip"])
    assert host.log[-1] == (3, "fmi2SetDebugLogging: there is no such category")
