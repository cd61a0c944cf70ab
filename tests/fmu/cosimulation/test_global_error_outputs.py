"""An FMU that is exported with errors has a parameter. If the host sets it, each output gives its global error instead of its
value."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

from tests.fmu.exported_fmus import FOLDER, arm
from tests.fmu.fmpy_host import Host
from trunnion.basics.errors import SceneError
from trunnion.fmu.scene_export import export
from trunnion.scene import models_dir

SHOWN = ["ball.qd[2]", "ball.friction*", "ball.contact[1].*"]
UNTIL, SPACING = 3.0, 0.05


@cache
def certified(fmi: int) -> Path:
    """8.1 with the parameter ``solver.errors``."""
    file = FOLDER / f"certified-{fmi}.fmu"
    export("spherical_pendulum", file, fmi=fmi, certify=True, outputs=SHOWN)
    return file


def run(file: Path, errors: int, rtol: float) -> np.ndarray:
    """A run of the FMU of ``certified`` in fmpy."""
    given = {"solver.errors": errors, "solver.tolerance": rtol}
    return simulate_fmu(str(file), stop_time=UNTIL, output_interval=SPACING, start_values=given)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_errors_that_an_fmu_states_are_those_from_a_far_tighter_run(fmi: int, rtol: float) -> None:
    file = certified(fmi)
    plain, told, exact = run(file, 0, rtol), run(file, 1, rtol), run(file, 0, 1e-13)
    names = [n for n in plain.dtype.names[1:] if n.partition(".")[2] and plain[n].dtype.kind == "f" and ".events." not in n]
    assert len(names) >= 7
    ratios: list[float] = []
    for n in names:
        true = np.maximum.accumulate(np.abs(plain[n] - exact[n]))[1:]
        error = told[n][1:]
        assert np.all(np.diff(error, axis=0) >= 0.0)
        counts = true > 3e-2 * rtol * np.abs(exact[n]).max() + 1e-12
        assert np.all(error[counts] >= 0.5 * true[counts])
        ratios += (error[counts] / true[counts]).tolist()
    assert np.median(ratios) == pytest.approx(1.6, abs=0.3)
    assert np.mean(np.array(ratios) < 5.0) > 0.95


def test_where_decisions_fall_otherwise_no_error_is_reported(tmp_path: Path) -> None:
    """A block at the limit of rest. One of the two runs releases the block and the other does not, or errors have grown."""
    file = tmp_path / "chaos.fmu"
    export(models_dir() / "stability" / "11_bifurcation.yaml", file, certify=True, outputs=["*.qd[*]"])
    given = {"solver.errors": 1, "solver.tolerance": 1e-4}
    told = simulate_fmu(str(file), stop_time=20.0, output_interval=0.05, start_values=given)
    values = np.array([told[n] for n in told.dtype.names[1:]])
    lost = np.isnan(values).any(axis=0)
    assert lost[-1]
    assert not lost[:5].any()
    assert np.all(np.diff(lost.astype(int)) >= 0)  # after the first time without an error, no error is stated


def test_without_the_parameter_the_numbers_are_those_of_an_fmu_that_has_none(tmp_path: Path) -> None:
    file = tmp_path / "plain.fmu"
    export("spherical_pendulum", file, outputs=SHOWN)
    plain = simulate_fmu(str(file), stop_time=UNTIL, output_interval=SPACING)
    both = simulate_fmu(str(certified(2)), stop_time=UNTIL, output_interval=SPACING)
    assert all(np.array_equal(plain[n], both[n]) for n in plain.dtype.names)
    names = [v.name for v in read_model_description(str(file)).modelVariables]
    assert "solver.errors" not in names


def test_errors_go_with_a_state_that_is_kept_written_and_read() -> None:
    host = Host(certified(2), solver__errors=1.0, solver__tolerance=1e-6)
    shown = ("ball.qd[2]", "ball.friction.torque[2]")
    host.run(0.0, 4, 0.25, *shown)
    state = host.fmu.getFMUState()
    kept = host.fmu.serializeFMUState(state)
    after = host.run(1.0, 4, 0.25, *shown)
    assert all(0.0 < x < 1e-2 for x in after[-1])
    for back in (state, host.fmu.deSerializeFMUstate(kept)):
        host.fmu.setFMUState(back)
        assert host.run(1.0, 4, 0.25, *shown) == after


def test_errors_follow_inputs_that_the_host_changes() -> None:
    """Two links with a torque and an angle as inputs. The inputs change at every communication point."""
    file = FOLDER / "certified-arm.fmu"
    export(arm(), file, certify=True, outputs=["*.q[*]", "*.qd[*]"])

    def moved(errors: float, rtol: float) -> np.ndarray:
        host = Host(file, solver__errors=errors, solver__tolerance=rtol)
        inputs = [v.name for v in host.md.modelVariables if v.causality == "input" and not v.name.startswith("inputs.")]
        rows = []
        for k in range(40):
            for n, name in enumerate(inputs):
                host.put(name, 0.1 * np.sin(0.3 * k + n))
            rows.append(host.run(0.025 * k, 1, 0.025, *host.all_outputs())[0])
        return np.array(rows)

    plain, told, exact = moved(0.0, 1e-5), moved(1.0, 1e-5), moved(0.0, 1e-12)
    assert np.all(told >= np.maximum.accumulate(np.abs(plain - exact)))
    assert told.max() < 1e-5 * np.abs(exact).max()  # a second run with other inputs would differ far more


@pytest.mark.parametrize("how", [{"flavour": "python"}, {"kind": "me"}])
def test_kinds_of_fmu_that_cannot_report_errors_are_refused(tmp_path: Path, how: dict) -> None:
    with pytest.raises(SceneError, match="only native FMUs for co-simulation can report errors"):
        export("spherical_pendulum", tmp_path / "x.fmu", certify=True, **how)


def test_bounded_steps_report_no_errors(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="error estimates need a second run"):
        export("spherical_pendulum", tmp_path / "x.fmu", certify=True, overrides={"simulation.realtime": {"step": 1e-3}})
