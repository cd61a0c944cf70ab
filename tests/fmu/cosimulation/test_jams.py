"""Joints that jam: if the scene continues through a jam, so does its FMU. Otherwise the FMU reports the jam as the engine reports
it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

import trunnion
from tests.fmu.exported_fmus import FOLDER
from tests.fmu.fmpy_host import Host
from trunnion.fmu.scene_export import export

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
GUIDE = "joints.guide.friction.half_length"


def through(half_length: float) -> dict[str, object]:
    """Overrides for example 8.3 with a guide so short that it jams. The run continues after a jam."""
    return {GUIDE: half_length, "simulation.jams": "impact"}


@cache
def jamming(half_length: float, flavour: str) -> Path:
    """The FMU of example 8.3 with the overrides of ``through``."""
    file = FOLDER / f"through-{half_length}-{flavour}.fmu"
    export("double_pendulum", file, flavour=flavour, overrides=through(half_length), outputs=["guide.q*", "events.*"])
    return file


@pytest.mark.default_cases(1)
@BOTH
@pytest.mark.parametrize("half_length", [0.22, 0.15], ids=["jams on its way", "jams at its start"])
def test_a_scene_that_goes_through_its_jams_does_so_in_its_fmu(half_length: float, flavour: str) -> None:
    """The engine passes the same jams. Rounding differs between engine and FMU, and errors of rtol 1e-6 grow at each of up to six
    impacts. The test therefore compares travels of 6 m to 1e-4 m. (After 4.94 s the guide jams as it reverses. The number of these
    jams depends on the tolerance: at 1e-9, three or none.)"""
    until, steps, names = 4.9, 49, ["events.count", "guide.q[1]"]
    asked = {"every": until / steps, "overrides": through(half_length), "outputs": names}
    expected = trunnion.simulate("double_pendulum", until=1.1 * until, **asked)  # an FMU does not know where its host stops
    assert expected.outcome.ok
    assert "impact" in {e.kind for e in expected.events}
    rows = np.array(Host(jamming(half_length, flavour)).run(0.0, steps, until / steps, *names))
    assert (rows[:, 0] == expected["events.count"][1 : steps + 1]).all()
    assert rows[:, 1] == pytest.approx(expected["guide.q[1]"][1 : steps + 1], abs=1e-4)


SHORT: dict[str, object] = {"bodies.rod.points.end": [0.4, 0, 0], "joints.guide.start.q": 0.9, "joints.slider_pin.friction.mu": 0.0}
ENDS: dict[str, tuple[str, dict[str, object], str]] = {
    "one of two joints jams": ("double_pendulum", {GUIDE: 0.22}, "jammed in joint guide"),
    "a loop ends its reach": ("crank_slider", SHORT, "open_loop in joint crank_pin"),
}


@pytest.mark.default_cases(1)
@BOTH
@pytest.mark.parametrize("how", ENDS)
def test_a_run_that_cannot_continue_is_reported_in_the_words_of_the_engine(how: str, flavour: str) -> None:
    model, changes, begin = ENDS[how]
    ended = trunnion.simulate(model, overrides=changes).outcome
    assert not ended.ok
    file = FOLDER / f"ends-{model}-{flavour}.fmu"
    export(model, file, flavour=flavour, overrides=changes, outputs=["events.*"])
    host = Host(file)
    with pytest.raises(FMICallException) as stopped:
        host.run(0.0, 500, 0.01)
    assert stopped.value.status == 2
    said = [text for _, text in host.log]
    assert str(ended) in said
    assert str(ended).startswith(begin)
