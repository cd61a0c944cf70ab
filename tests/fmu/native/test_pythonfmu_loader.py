"""The loader between host and pythonfmu. Messages of the python flavour's slave reach the host, as in the native flavour."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from tests.fmu.cosimulation.test_state_serialization import flipped, midway, refusal
from tests.fmu.exported_fmus import exported
from tests.fmu.fmpy_host import Host

BOTH = pytest.mark.parametrize("flavour", ["native", "python"])
OK, DISCARD, ERROR = 0, 2, 3
PATHS = ["plain", "with space", "ünïcode", "hash#tag", "per%cent", "plus+and&", "br(ack)[1]", "100%25", "漢字"]


def status_of(call, *arguments) -> int:
    """The status a call returns."""
    try:
        call(*arguments)
    except FMICallException as e:
        return e.status
    return OK


@BOTH
def test_an_invalid_call_returns_its_error_and_the_run_continues(flavour: str) -> None:
    host, same = (Host(exported("spherical_pendulum", flavour)) for _ in range(2))
    mu, tip = "joints.ball.friction.mu", "pendulum.tip.position[3]"
    host.run(0.0, 3, 0.01)
    assert status_of(host.put, mu, -0.1) == DISCARD
    assert status_of(host.put, mu, float("nan")) == ERROR
    assert status_of(host.put, "bodies.pendulum.mass", 5.0) == ERROR
    assert status_of(host.fmu.getReal, [4_000_000]) == ERROR
    assert status_of(host.fmu.setReal, [4_000_000], [0.0]) == ERROR
    assert status_of(host.fmu.getString, [0]) == ERROR
    assert status_of(host.fmu.doStep, 0.03, -0.01) == DISCARD
    assert host.fmu.getStatus(0) == DISCARD
    assert status_of(host.fmu.doStep, 0.7, 0.01) == ERROR
    assert [status for status, _ in host.log] == [DISCARD, *[ERROR] * 5, DISCARD, ERROR]
    same.run(0.0, 3, 0.01)
    assert host.run(0.03, 3, 0.01, tip) == same.run(0.03, 3, 0.01, tip)
    assert host.fmu.getStatus(0) == OK
    assert host.fmu.getRealStatus(2) == pytest.approx(0.06)


@BOTH
def test_an_initialisation_that_fails_returns_that_it_failed(flavour: str) -> None:
    host = Host(exported("crank_slider", flavour), begin=False)
    host.put("joints.crank_pivot.drive.constant.rate", 1e300)
    assert status_of(host.fmu.exitInitializationMode) == ERROR
    assert status_of(host.fmu.doStep, 0.0, 0.01) == ERROR
    host.fmu.reset()
    host.fmu.setupExperiment()
    host.fmu.enterInitializationMode()
    host.fmu.exitInitializationMode()
    host.run(0.0, 3, 0.01)


@BOTH
def test_a_guid_that_is_not_its_own_is_refused(flavour: str) -> None:
    good = Host(exported("arm", flavour))
    other = FMU2Slave(guid="another", unzipDirectory=good.unzipped, instanceName="i", modelIdentifier="arm")
    with pytest.raises(Exception, match="instantiate"):
        other.instantiate(callbacks=good._callbacks())
    assert good.log[-1][1] == "the GUID is not that of this FMU: use the modelDescription.xml of the same export"


def test_states_are_looked_at_as_by_the_native_flavour() -> None:
    host, state = midway(exported("arm", "python"))
    assert refusal(host, flipped(state, 4321)) == "these bytes are a damaged state: the checksum is wrong; use an undamaged copy"
    assert refusal(host, state) == ""


def test_calls_that_pythonfmu_does_not_pass_on_reach_the_model() -> None:
    """Derivatives of inputs have the numbers of the native flavour. Therefore derivatives of outputs have these numbers, too."""
    found = []
    for flavour in ("native", "python"):
        host = Host(exported("arm", flavour), angle=0.2)
        at = host.reference["angle"]
        for k in range(5):
            host.set(angle=0.2 + 2 * (0.02 * k) ** 2)
            host.fmu.setRealInputDerivatives([at, at], [1, 2], [0.08 * k, 4.0])
            host.fmu.doStep(0.02 * k, 0.02)
        unknown = [host.reference[n] for n in ("knee.qdd[1]", "hip.drive.effort[1]")]
        exact = host.fmu.getDirectionalDerivative(unknown, [host.reference["motor"]], [1.0])
        found.append([*exact, *host.get("hip.q[1]", "knee.qd[1]")])
    assert np.array_equal(*found)
    assert found[0][2] == pytest.approx(0.2 + 2 * 0.1**2, abs=1e-13)


RUN = "import sys; from fmpy import simulate_fmu; simulate_fmu(sys.argv[1], validate=False, stop_time=0.02, step_size=0.01)"


@pytest.mark.default_cases(1)
@BOTH
def test_an_fmu_runs_in_any_folder(flavour: str, tmp_path: Path) -> None:
    """Each run has a separate process, because a bad path may end the process. pythonfmu itself replaces %20 by a blank; such a
    path is refused."""
    plain = tmp_path / flavour
    extract(str(exported("spherical_pendulum", flavour)), str(plain))
    for name in [*PATHS, "a%20b"]:
        shutil.copytree(plain, tmp_path / "in" / name)
        done = subprocess.run([sys.executable, "-c", RUN, tmp_path / "in" / name], capture_output=True, text=True, check=False)
        if name == "a%20b" and flavour == "python":
            assert done.returncode == 1, "an exception in fmpy, no crash"
            assert "pythonfmu takes %20" in done.stdout + done.stderr
        else:
            assert done.returncode == 0, (name, done.stderr)
