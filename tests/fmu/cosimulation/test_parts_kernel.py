"""FMUs made of parts contain tables and parts as C text. Their results equal the engine's run on parts to the last bit. The stored
state of an FMU can be loaded at another place in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import trunnion
from tests.fmu.engine_comparison import BEYOND, ROWS, engine_run, fmu_run
from tests.fmu.exported_fmus import FOLDER, arm, exported
from tests.fmu.fmi3.event_mode_host import Host3
from tests.fmu.fmpy_host import Host
from trunnion.basics.errors import SceneError
from trunnion.fmu.binaries import platform_builds
from trunnion.fmu.scene_export import export
from trunnion.kernel.compilation import c_compiler

MODELS = ("spherical_pendulum", "crank_slider")
UNTIL = 0.5


def of_parts(model: str, flavour: str = "native") -> Path:
    """The FMU of a model (or of ``arm``), made of parts."""
    file = FOLDER / f"{model}-{flavour}-parts.fmu"
    if not file.exists():
        export(arm() if model == "arm" else model, file, flavour=flavour, kernel="parts", outputs="*")
    return file


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("model", MODELS)
def test_an_fmu_of_parts_equals_the_engines_run_to_the_last_bit(model: str) -> None:
    expected = engine_run(model, UNTIL, kernel="parts")
    names = [n for n in expected if n != "time"]
    for flavour in ("native", "python"):
        found = fmu_run(of_parts(model, flavour), UNTIL, names)
        assert not [n for n in names if not np.array_equal(found[n], expected[n])]


def test_parts_compiled_without_optimisation_move_alike_up_to_round_off() -> None:
    assert c_compiler.quick()
    found = trunnion.simulate("spherical_pendulum", until=BEYOND * UNTIL, every=UNTIL / ROWS, kernel="parts")
    expected = engine_run("spherical_pendulum", UNTIL, kernel="parts")
    for name in ("time", "ball.qd[1]", "ball.qdd[2]", "ball.contact[1].normal_force"):
        np.testing.assert_allclose(found[name][: ROWS + 1], expected[name], rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_a_stored_state_continues_in_a_library_at_another_address() -> None:
    here, there = Host(of_parts("arm")), Host(of_parts("arm"))
    assert here.unzipped != there.unzipped
    columns = here.all_outputs()
    here.run(0.0, 20, 0.01)
    kept = here.fmu.serializeFMUState(here.fmu.getFMUState())
    expected = here.run(0.2, 20, 0.01, *columns)
    here.fmu.freeInstance()  # this also unloads the library with the tables
    there.fmu.setFMUState(there.fmu.deSerializeFMUstate(kept))
    assert there.run(0.2, 20, 0.01, *columns) == expected


def test_an_fmu_of_fmi_3_stops_at_the_same_events_as_one_of_fmi_2(tmp_path: Path) -> None:
    file = tmp_path / "three.fmu"
    export("spherical_pendulum", file, kernel="parts", fmi=3)
    three, two = Host3(file), Host(of_parts("spherical_pendulum"))
    events, rows = three.run(3.0, 0.1, "ball.qd")
    assert [clocks for _, clocks, *_ in events] == 3 * [["ball.events.reversal"]]
    found, now = [], 0.0
    for k in range(30):
        end = (k + 1) * 0.1
        two.fmu.doStep(now, end - now)
        found.append(two.get("ball.qd[1]", "ball.qd[2]", "ball.qd[3]"))
        now = end
    assert found == rows


def test_directional_derivatives_are_those_of_compiled_code() -> None:
    both = []
    for file in (of_parts("arm"), exported("arm")):
        host = Host(file)
        host.run(0.0, 10, 0.01)
        names = ["knee.qdd[1]", "hip.drive.effort[1]", "two.acceleration[1]"]
        known = [host.reference[n] for n in ("motor", "angle")]
        both.append([host.fmu.getDirectionalDerivative([host.reference[n] for n in names], [k], [1.0]) for k in known])
    np.testing.assert_allclose(*both, rtol=1e-6)  # both runs have errors of rtol 1e-6
    assert np.abs(both[0]).max() > 0.1


@pytest.mark.slow
def test_for_another_structure_of_the_same_kinds_only_tables_are_compiled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def pendulum(count: int) -> trunnion.Scene:
        from tests.engine.stick_slip.test_active_set_many_pairs import links

        return links(count, 0, "revolute", apart=False)

    export(pendulum(2), tmp_path / "first.fmu", kernel="parts")
    compiled: list[str] = []
    usual = platform_builds._compile
    monkeypatch.setattr(platform_builds, "_compile", lambda *given: (compiled.append(given[-1][-1]), usual(*given))[1])
    export(pendulum(3), tmp_path / "second.fmu", kernel="parts")
    assert {Path(name).stem for name in compiled} <= {"kernel", "outputs", "jacobian", "model", "-lc"}


def test_the_default_kernel_is_the_fastest_for_long_runs(tmp_path: Path) -> None:
    export("spherical_pendulum", tmp_path / "usual.fmu")
    assert (tmp_path / "usual.fmu").read_bytes() == exported("spherical_pendulum").read_bytes()


def test_a_kernel_that_is_none_and_a_compiler_that_is_missing_are_reported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"'quick' is not a kernel \(one of auto, compiled, parts\)"):
        export("spherical_pendulum", tmp_path / "a.fmu", kernel="quick")
    with pytest.raises(SceneError, match="'lanes' is not a kernel"):  # an FMU runs one case, so it has no SIMD lanes
        export("spherical_pendulum", tmp_path / "a.fmu", kernel="lanes")
    monkeypatch.setattr(c_compiler, "there", lambda module: False)
    with pytest.raises(SceneError, match=r"pip install 'trunnion\[compile\]'"):
        export("spherical_pendulum", tmp_path / "a.fmu")
