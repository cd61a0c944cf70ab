"""For every row of the gallery and every equivalent scene, the verdict is correct on both sides of the threshold."""

from __future__ import annotations

import math

import pytest

from tests.stability.entries.mass_springs_spin import massive
from tests.stability.equivalent_scenes import TELLINGS, told
from tests.stability.gallery import ROWS
from tests.stability.gallery_entry import EDGE, Row
from trunnion.basics.errors import SceneError
from trunnion.scene import load_scene, models_dir
from trunnion.scene.overrides import apply
from trunnion.simulation.settings import kernel_choice
from trunnion.system.construction.system_builder import build as system_of

FOLDER = models_dir() / "stability"


@pytest.mark.default_cases(16)
@pytest.mark.parametrize("telling", TELLINGS)
@pytest.mark.parametrize("row", ROWS, ids=lambda r: f"{r.number}_{r.name}")
def test_a_row_has_its_stated_results_below_and_beyond_its_threshold(row: Row, telling: str) -> None:
    asked(row, telling, slow=False)


@pytest.mark.default_cases(4)
@pytest.mark.parametrize("row", ROWS, ids=lambda r: f"{r.number}_{r.name}")
def test_compiled_scenes_have_the_same_verdicts(row: Row, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each run in this test uses the compiled kernel, as in a large batch. The other tests use kernels made of parts."""
    monkeypatch.setattr(kernel_choice, "RUNS", 0)
    assert kernel_choice.kernel_of(system_of(row.edges[0].scene(EDGE)).system)[0] == "compiled"
    asked(row, TELLINGS[0], slow=False)


@pytest.mark.slow
@pytest.mark.default_cases(41)
@pytest.mark.parametrize("telling", TELLINGS)
@pytest.mark.parametrize("row", [r for r in ROWS if any(e.slow for e in r.edges)], ids=lambda r: f"{r.number}_{r.name}")
def test_a_row_with_a_slow_threshold_has_its_stated_results_below_and_beyond_the_threshold(row: Row, telling: str) -> None:
    asked(row, telling, slow=True)


def asked(row: Row, telling: str, slow: bool) -> None:
    """Test the slow thresholds of a row, or its other thresholds."""
    for edge in (e for e in row.edges if e.slow == slow):
        for beyond, expected in edge.sides:
            scene = told(edge.scene(beyond), telling, row.number, runs=expected != "refused")
            assert edge.verdict(scene) == expected, (edge.at, beyond)


@pytest.mark.parametrize("row", ROWS, ids=lambda r: f"{r.number}_{r.name}")
def test_the_scene_file_of_a_row_holds_its_scene(row: Row) -> None:
    file = FOLDER / f"{row.number:02d}_{row.name}.yaml"
    assert load_scene(str(file)).joints.keys() == row.edges[0].scene(EDGE).joints.keys()


def test_numbers_that_are_none_are_refused_by_name() -> None:
    with pytest.raises(SceneError, match=r"bodies\.b\.mass"):
        apply(massive(1.0), {"bodies.b.mass": math.nan})


def test_the_gallery_has_all_forty_rows() -> None:
    assert [r.number for r in ROWS] == list(range(1, 41))
    assert len(list(FOLDER.glob("*.yaml"))) == 40
