"""FMI 3.0: refused calls with their status and message, and requests that the command refuses."""

from __future__ import annotations

import ctypes
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3ScheduledExecution

import trunnion
from tests.fmu.cosimulation.test_jams import ENDS
from tests.fmu.exported_fmus import FOLDER, exported
from tests.fmu.fmi3.event_mode_host import DISCARD, ERROR, Host3
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.cli.command_group import COMMAND
from trunnion.fmu.binaries.platform_builds import chosen
from trunnion.fmu.scene_export import export


def test_refused_values_are_discarded_with_the_words_of_the_scene_and_the_run_continues() -> None:
    host, same = Host3(exported("spherical_pendulum", fmi=3)), Host3(exported("spherical_pendulum", fmi=3))
    with pytest.raises(FMICallException) as refused:
        host.put("joints.ball.friction.mu", -0.1)
    assert refused.value.status == DISCARD
    assert host.log[-1][1] == "joints.ball.friction.mu: mu must not be negative (it is -0.1)"
    assert host.run(0.5, 0.1, "ball.q") == same.run(0.5, 0.1, "ball.q")


def test_a_run_that_cannot_continue_is_discarded_with_its_time_and_asks_to_be_ended() -> None:
    model, changes, begin = ENDS["a loop ends its reach"]
    file = FOLDER / "ends-3.fmu"
    export(model, file, overrides=changes, outputs=["events.*"], fmi=3)
    ended = trunnion.simulate(model, overrides=changes).outcome
    host = Host3(file, events=False)
    out = [ctypes.c_bool() for _ in range(3)] + [ctypes.c_double()]
    with pytest.raises(FMICallException) as stopped:
        host.fmu.fmi3DoStep(host.fmu.component, 0.0, 5.0, True, *map(ctypes.byref, out))
    assert stopped.value.status == DISCARD
    assert [x.value for x in out[:3]] == [False, True, False]
    assert out[3].value == pytest.approx(ended.time, abs=1e-4)
    assert begin in host.log[-1][1]


OUT_OF_PLACE: dict[str, Callable] = {
    "its instantiation token is another's": lambda h: Host3.__init__(h, _renamed()),
    "no structural parameters": lambda h: h.fmu.enterConfigurationMode(),
    "scheduled execution": lambda h: FMU3ScheduledExecution(**_of(h)).instantiate(logMessage=h._hear),
    "event mode twice": lambda h: (h.fmu.enterEventMode(), h.fmu.enterEventMode()),
    "clocks in step mode": lambda h: h.ticking(),
    "a step in event mode": lambda h: (h.fmu.enterEventMode(), h.step(1.0)),
    "an update in step mode": lambda h: h.fmu.updateDiscreteStates(),
    "initialization twice": lambda h: h.fmu.enterInitializationMode(),
    "an unknown reference": lambda h: h.fmu.getFloat64([9999]),
    "an inner component of an array": lambda h: h.fmu.getFloat64([h.reference["one.position"] + 1]),
    "a clock that is set": lambda h: h.fmu.setClock([h.reference["knee.events.stick"]], [True]),
    "dependencies by element": lambda h: h.fmu.fmi3GetNumberOfVariableDependencies(
        h.fmu.component, 0, ctypes.byref(ctypes.c_size_t())),
    "an interval of a triggered clock": lambda h: h.fmu.fmi3GetIntervalDecimal(
        h.fmu.component, (ctypes.c_uint * 1)(h.reference["knee.events.stick"]), 1, (ctypes.c_double * 1)(), (ctypes.c_int * 1)()),
}  # fmt: skip


def _of(host: Host3) -> dict[str, str]:
    """Arguments with which fmpy makes another instance of the FMU of a host."""
    return {"guid": host.md.instantiationToken, "unzipDirectory": host.fmu.unzipDirectory, "instanceName": "other",
            "modelIdentifier": host.md.coSimulation.modelIdentifier}  # fmt: skip


def _renamed() -> Path:
    """The FMU of ``arm`` with a description of another version."""
    file = FOLDER / "renamed-3.fmu"
    with zipfile.ZipFile(exported("arm", fmi=3)) as old, zipfile.ZipFile(file, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b'instantiationToken="', b'instantiationToken="x')
            new.writestr(name, data)
    return file


@pytest.mark.default_cases(10)
@pytest.mark.parametrize("what", OUT_OF_PLACE)
def test_an_invalid_call_returns_an_error_with_a_message(what: str) -> None:
    host = Host3(exported("arm", fmi=3))
    with pytest.raises(Exception, match=r"status 3|Failed to instantiate"):
        OUT_OF_PLACE[what](host)
    assert host.log[-1][0] == ERROR
    assert len(host.log[-1][1]) > 10


def test_the_command_writes_fmi_3_and_reports_what_does_not_go_with_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "three.fmu"
    assert main(["fmu", "simple_pendulum", "--fmi", "3", "-o", str(file), "--outputs", "bob.*", "--step", "1ms"]) == 0
    assert "FMI 3.0, flavour native" in capsys.readouterr().out
    assert float(next(v.start for v in read_model_description(file).modelVariables if v.name == "solver.step")) == 1e-3
    for words, where, what in [
        (["--fmi", "3", "--flavour", "python"], "--flavour", "pythonfmu writes FMI 2.0 only"),
        (["--fmi", "4"], "--fmi", "4 is not a supported version of FMI"),
        (["--fmi", "2", "--platform", "aarch64-windows"], "--platform", "FMI 2.0 has no folder for aarch64-windows"),
        (["--platform", "aarch64-linux", "--platform", "all"], "--platform",
         "FMI 2.0 has one folder for 64-bit Linux, so aarch64-linux excludes other platforms"),
        (["--flavour", "python", "--platform", "aarch64-linux"], "--platform", "the python flavour does not support aarch64-linux"),
        (["--platform", "linux32"], "--platform",
         "linux32 has 32 bits, and 32-bit libraries would not set the floating-point environment"),
        (["--fmi", "3", "--platform", "amiga"], "--platform", "'amiga' is not a supported platform"),
    ]:
        with pytest.raises(SceneError) as refused:
            COMMAND.main(["fmu", "simple_pendulum", "-o", str(tmp_path / "none.fmu"), *words], standalone_mode=False)
        assert [(p.where, p.what) for p in refused.value.problems] == [(where, what)]
    assert chosen(["x86_64-windows", "linux64"], "3.0") == ["linux64", "win64"]
    assert chosen(["all"]) == ["linux64", "win64", "darwin64", "aarch64-darwin"]
    assert not (tmp_path / "none.fmu").exists()
