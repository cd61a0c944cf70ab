"""Results for the tests of plots: one result made by hand, which needs no kernel, and runs of the paper's examples."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.paper_friction_law import PAPER
from tests.plots.webgl_browser import OPEN, SOFTWARE, Opened, browsers, opened
from trunnion.kernel.interface.output_columns import columns
from trunnion.plots import animate
from trunnion.plots.mechanism_pictures.instant_picture import needed
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.results.event import Event
from trunnion.simulation.results.outcome import DONE, Outcome
from trunnion.simulation.results.result import Result
from trunnion.simulation.results.result_data import Stats
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

REVERSALS = (1.0, 2.5)


def made(scene: Scene, until: float = 4.0, rows: int = 401, values: dict[str, np.ndarray] | None = None) -> Result:
    """A result of a scene with every column. Values are zero, except identity orientations and the given values."""
    table = columns(build(scene).system)
    data = np.zeros((rows, 1 + len(table)))
    data[:, 0] = np.linspace(0.0, until, rows)
    given = values or {}
    for i, c in enumerate(table):
        unity = c.name.endswith(("orientation[1]", ".state")) or (c.name.endswith(".q[1]") and c.name.startswith("ball"))
        data[:, i + 1] = given.get(c.name, np.ones(rows) if unity else np.zeros(rows))
    stats = Stats(0.01, 0.0, 0.01, 100, 3, 1300, 0, len(REVERSALS))
    settings = {"until": until, "every": until / (rows - 1), "rtol": 1e-6, "method": "auto", "step": 0.0}
    events = tuple(Event(t, "reversal", "ball", 1, (0.5,), (-0.5,), (1.0,)) for t in REVERSALS)
    return Result(scene, data, tuple(table), events, Outcome(DONE, until), stats, settings, ("a note",))


@pytest.fixture
def pendulum() -> Result:
    """A result of example 8.1 with invented curves. A contact angle turns twice and jumps, and the torque has one component."""
    t = np.linspace(0.0, 4.0, 401)
    angle = np.remainder(2 * np.pi * t / 2 + np.pi, 2 * np.pi) - np.pi
    curves = {
        "ball.contact[1].angle": angle,
        "ball.contact[1].normal_force": 700 + 100 * np.cos(t),
        "ball.contact[1].normal[1]": np.cos(angle),
        "ball.contact[1].normal[3]": np.sin(angle),
        "ball.friction.torque[2]": 20 * np.sin(t),
        "ball.friction.torque[1]": 1e-15 * np.sin(t),
        "ball.qdd[2]": np.cos(3 * t),
    }
    return made(load_scene("spherical_pendulum"), values=curves)


@pytest.fixture(scope="session")
def swing() -> Result:
    """A run of example 8.1."""
    return simulate("spherical_pendulum", until=3.0, overrides=PAPER)


@pytest.fixture(scope="session")
def slider() -> Result:
    """A run of example 8.2 over one turn of the crank."""
    return simulate("crank_slider", until=0.65, overrides=PAPER)


@pytest.fixture(scope="session")
def double() -> Result:
    """A run of example 8.3."""
    return simulate("double_pendulum", until=2.0, every=0.01, overrides=PAPER)


@pytest.fixture(scope="package")
def starts() -> Iterator[Callable[..., Any]]:
    """A function that starts a browser with given flags. While the browser exists, no other event loop can run, so the browser ends
    with the tests of this folder."""
    with browsers() as start:
        yield start


@pytest.fixture(scope="package")
def chrome(starts: Callable[..., Any]) -> Iterator[Any]:
    """A browser that draws in three dimensions."""
    made = starts(*SOFTWARE)
    yield made
    made.close()


@pytest.fixture(scope="session")
def press(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = load_scene("toggle_press")
    run = simulate(scene, until=1.0, overrides={"parameters.speed": -0.02}, outputs=needed(scene))
    return animate(run, tmp_path_factory.mktemp("press") / "press.html")


@pytest.fixture
def shown(chrome: Any, press: Path) -> Iterator[Opened]:
    """The press in a window of the size of a desktop screen. At the end, the page must have no errors."""
    out = opened(chrome, press)
    yield out
    assert out.wrong == []


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    """Close the pages that the test has opened."""
    yield
    while OPEN:
        OPEN.pop().close()
