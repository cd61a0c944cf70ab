"""The picture of an FMU is drawn once for each mechanism and start."""

from __future__ import annotations

from pathlib import Path

import pytest

from trunnion import simulate
from trunnion.fmu.model_description import documentation_and_picture
from trunnion.simulation.results.result import Result


def test_a_mechanism_is_drawn_once_and_again_for_another_start(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TRUNNION_CACHE", str(tmp_path))
    drawn: list[Result] = []
    monkeypatch.setattr(documentation_and_picture, "draw", lambda result: drawn.append(result) or f"picture {len(drawn)}".encode())
    starts: list[dict[str, float]] = [{}, {"joints.pivot.start.q": 0.3}]
    level, tilted = (simulate("simple_pendulum", 1e-3, overrides=start, kernel="parts") for start in starts)
    pictures = [documentation_and_picture.picture(r) for r in (level, level, tilted, level)]
    assert pictures == [b"picture 1", b"picture 1", b"picture 2", b"picture 1"]
