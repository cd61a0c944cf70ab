"""The animation has depth: near bodies hide far bodies, points are where the matrices place them, and contact patches are on
pins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.plots.ray_visibility import ALIKE, HATCHED, behind_the_cut, compared, first_hit, hue, rays
from tests.plots.webgl_browser import Opened, opened
from trunnion.plots import animate
from trunnion.plots.geometry.meshes import FINE, Mesh, box, cylinder, sphere
from trunnion.plots.mechanism_pictures.instant_picture import needed
from trunnion.scene import load_scene, scene_from_text
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate


@pytest.fixture(scope="module")
def axle(chrome: Any, tmp_path_factory: pytest.TempPathFactory) -> Opened:
    """The wishbone axle, in which arms pass behind wheels. Symbols that are drawn over the bodies are switched off."""
    scene = load_scene("wishbone_corner")
    run = simulate(scene, until=0.1, outputs=needed(scene))
    page = opened(chrome, animate(run, tmp_path_factory.mktemp("view") / "axle.html"), "?values=0", kept=True, dots=1)
    page.do("run.joints.forEach((j) => { j.pins = []; }); run.springs.length = 0; run.rails.length = 0; things = prepared()")
    return page


TURNED = [(0.0, 0.0), (1.3, 0.1), (-2.0, -0.2), (3.1, 0.4)]
SECTIONS = [("view", 0.7, 0.5), ("view", 0.8, 2.2), ("x", 0.7, -0.6), ("z", 0.5, 0.3)]


def each_once(views: list[tuple[Any, ...]]) -> list[Any]:
    """Each view in parallel and in perspective projection. By default, every view is tested in one projection, and with ``-m slow``
    in the other projection."""
    both = [(view, parallel, i % 2 == parallel) for i, view in enumerate(views) for parallel in (False, True)]
    return [pytest.param(*view, parallel, marks=() if now else pytest.mark.slow) for view, parallel, now in both]


@pytest.mark.default_cases(2)
@pytest.mark.parametrize(("turned", "parallel"), each_once([(view,) for view in TURNED]))
def test_every_pixel_shows_the_body_nearest_to_the_eye(axle: Opened, turned: tuple[float, float], parallel: bool) -> None:
    """The reference casts rays through every triangle, at places with only one body around them."""
    axle.do(f"view = firstView(); turn({turned[0]}, {turned[1]}); look.parallel = {str(parallel).lower()}; look.xray = false")
    seen, wrong = compared(axle, first_hit)
    assert seen > 150
    assert wrong == 0


NESTED = """
bodies:
  housing: {box: [0.4, 0.3, 0.3], mass: 1, color: steelblue}
  core: {sphere: 0.08, mass: 1, color: firebrick, center: [0.05, 0, 0]}
  lever: {box: [0.1, 0.5, 0.04], mass: 1, color: gold, center: [0.1, 0.2, 0.05]}
joints:
  a: {type: revolute, axis: z, inboard: ground, outboard: housing}
  b: {type: revolute, axis: z, inboard: ground, outboard: core}
  c: {type: revolute, axis: z, inboard: ground, outboard: lever}
"""


@pytest.fixture(scope="module")
def nested(chrome: Any, tmp_path_factory: pytest.TempPathFactory) -> Opened:
    """A box with a ball in it and a lever through its side."""
    scene = scene_from_text(NESTED)
    run = simulate(scene, until=0.01, outputs=needed(scene))
    page = opened(chrome, animate(run, tmp_path_factory.mktemp("view") / "nested.html"), "?values=0", kept=True, dots=1)
    page.do("run.joints.forEach((j) => { j.pins = []; }); run.rails.length = 0; things = prepared()")
    return page


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("across", "at", "turned", "parallel"), each_once(SECTIONS))
def test_a_section_shows_bodies_as_solid(nested: Opened, across: str, at: float, turned: float, parallel: bool) -> None:
    """In a section, the inside of cut bodies is filled. The reference uses rays that begin at the plane of the section."""
    nested.do(f"view = firstView(); turn({turned}, 0.2); look.parallel = {str(parallel).lower()}")
    nested.do(f"look.cutFrom = view.toward.slice(); look.cut = '{across}'; look.cutAt = {at}")
    cut = np.array(nested.ask("cutting()"))
    seen, wrong = compared(nested, lambda *sight: behind_the_cut(*sight, cut), HATCHED)
    assert seen > 50
    assert wrong == 0


def test_a_wheel_hides_the_arms_behind_it(axle: Opened) -> None:
    """From outside, the wheel is visible where the arms end in the wheel. From inside, the arms are visible. The flat picture
    cannot show this difference."""
    axle.do("view = firstView(); look.parallel = true; along('side')")
    if axle.ask("view.toward[1]") < 0:
        axle.do("turn(Math.PI, 0)")
    names = axle.ask("run.parts.map((p) => p.name)")
    m, cam = axle.ask("moment(clock.t)"), axle.ask("camera(moment(clock.t))")
    point = np.array(m["poses"][names.index("corner1_lower")]["p"])
    spot = axle.ask(f"camera(moment(clock.t)).project({point.tolist()})")[:2]
    hit = first_hit(axle, m, *rays(cam, np.array([spot])))[0]
    assert names[hit] == "corner1_upright"
    shown = axle.pixels()[int(spot[1]) - 20, int(spot[0]) + 14]
    color = axle.ask(f"run.parts[{hit}].color")
    assert hue(shown) == pytest.approx(hue(np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)])), abs=ALIKE)


@pytest.mark.parametrize("parallel", [False, True])
def test_points_are_where_the_matrix_puts_them(axle: Opened, parallel: bool) -> None:
    """The function ``project`` (names, pointer) and the matrix of the graphics card agree to 0.01 pixels (the matrix has single
    precision)."""
    axle.do(f"view = firstView(); turn(0.7, 0.2); zoom(1.7); look.parallel = {str(parallel).lower()}")
    points = np.random.default_rng(3).uniform(-0.8, 0.8, (40, 3))
    cam = axle.ask("camera(moment(clock.t))")
    told = np.array(axle.ask(f"{points.tolist()}.map((p) => camera(moment(clock.t)).project(p))"))
    clip = np.column_stack([points, np.ones(40)]) @ np.array(cam["matrix"], float).reshape(4, 4)
    flat = clip[:, :2] / clip[:, 3:]
    expected = np.column_stack([cam["w"] * (1 + flat[:, 0]) / 2, cam["h"] * (1 - flat[:, 1]) / 2])
    np.testing.assert_allclose(told[:, :2], expected, atol=0.01)
    toward = np.array(cam["toward"])
    order = np.argsort(points @ toward)
    if parallel:
        assert np.all(np.diff((clip[:, 2] / clip[:, 3])[order]) <= 1e-6)  # a point nearer to the viewer has a smaller depth


def quaternion(q: np.ndarray) -> np.ndarray:
    """Rotation matrix by Rodrigues' formula of a unit quaternion's axis and angle."""
    angle, axis = 2 * np.arctan2(np.linalg.norm(q[1:]), q[0]), q[1:] / max(float(np.linalg.norm(q[1:])), 1e-300)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def centre(run: Result, body: str, row: int, arm: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """(point ``arm`` from a body's mass centre, rotation) from its columns."""
    turn = quaternion(np.array([run[f"{body}.orientation[{k}]"][row] for k in (1, 2, 3, 4)]))
    return np.array([run[f"{body}.position[{k}]"][row] for k in (1, 2, 3)]) + turn @ arm, turn


def rims(run: Result, name: str, row: int) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(place on the middle line of the pin, direction of this line, radius) of each contact, from the numbers of the examples."""
    if name == "slider":
        p, turn = centre(run, "slider", row, (0, 0, 0))
        return [(p + s * 0.05 * turn[:, 2], turn[:, 2], 0.01) for s in (-1, 1)]
    p, upper = centre(run, "upper", row, (-0.5, 0, 0))
    q, _ = centre(run, "upper", row, (0.5, 0, 0))
    _, lower = centre(run, "lower", row, (0, 0, 0))
    guide = [(p + s * 0.3 * upper[:, 1], upper[:, 1], 0.05) for s in (-1, 1)]
    return [*guide, *((q + s * 0.05 * e, e, 0.01) for e in (upper[:, 1], lower[:, 2]) for s in (-1, 1))]


CONTACTS = (
    "shown.m.contacts.map((c) => ({point: c.point, normal: c.normal, force: c.force, model: patchPose(shown.m, c).uModel,"
    " v: patchOf(c.mark).v}))"
)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", ["slider", "double"])
def test_every_contact_of_the_table_has_its_patch_on_its_pin(
    name: str, chrome: Any, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The numbers of the examples and the columns of the bodies give the pins, to 1e-5 m. The page stores rows in single precision,
    and joints are closed to the tolerance of the run. The patch is raised by 0.6 % of the radius, and a facet of the patch is lower
    by the same amount."""
    run = request.getfixturevalue(name)
    page = opened(chrome, animate(run, tmp_path / "c.html"))
    columns = run.matching("*.contact[*].normal_force")
    for row in (20, 41, 60):
        page.do(f"clock.t = {float(run.time[row])!r}")
        found, wanted = page.ask(CONTACTS), rims(run, name, row)
        assert [c["force"] for c in found] == pytest.approx([run[x][row] for x in columns], rel=1e-5)
        for c, (place, axis, radius) in zip(found, wanted, strict=True):
            out = c["point"] - place
            assert np.linalg.norm(out) == pytest.approx(radius, abs=1e-5)
            assert abs(out @ axis) < 1e-5
            assert out @ c["normal"] == pytest.approx(radius, abs=1e-5)
            spots = np.column_stack([np.reshape(c["v"], (-1, 3)), np.ones(len(c["v"]) // 3)]) @ np.reshape(c["model"], (4, 4))
            np.testing.assert_allclose(np.linalg.norm(np.cross(spots[:, :3] - place, axis), axis=1), radius, rtol=0.01, atol=1e-5)
            assert np.linalg.norm(spots[:, :3] - c["point"], axis=1).min() < 0.02 * radius
    assert page.wrong == []


def test_a_contact_is_seen_where_it_is_in_the_colour_of_its_state(swing: Result, chrome: Any, tmp_path: Path) -> None:
    """Seen along its normal, the contact of the ball appears at the ball's centre (the origin) plus radius times the normal in the
    table."""
    page = opened(chrome, animate(swing, tmp_path / "s.html"), "?values=0", dots=1)
    for row in (15, 40, 90):
        n = [float(swing[f"ball.contact[1].normal[{k}]"][row]) for k in (1, 2, 3)]
        page.do(f"clock.t = {float(swing.time[row])!r}; run.arrow = 0; view.toward = unit({n})")
        page.do("view.right = unit(cross([0, 1, 0], view.toward)); view.up = cross(view.toward, view.right)")
        page.do("section('view'); look.cutAt = 0")  # the section removes bodies in front of the contact
        point = [0.05 * x for x in n]
        assert page.ask("shown.m.contacts[0].point") == pytest.approx(point, abs=1e-6)
        state = page.ask("run.states[String(shown.m.contacts[0].state)][0]")
        x, y = page.ask(f"shown.cam.project({point})")[:2]
        shown = page.pixels()[int(y), int(x), :3]
        np.testing.assert_allclose(shown, [int(state[k : k + 2], 16) for k in (1, 3, 5)], atol=40)


SHAPES = {
    "box": box(1.0, 0.2, 0.3), "fine box": box(1.0, 0.2, 0.3, FINE), "cylinder": cylinder(0.2, 1.0, 1, FINE), "ball": sphere(0.4),
}  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_are_closed(shape: str) -> None:
    """Every edge occurs once in each direction, so no face is missing."""
    mesh: Mesh = SHAPES[shape]
    _, ids = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)
    sides = [(int(ids[f[k]]), int(ids[f[(k + 1) % len(f)]])) for f in mesh.faces for k in range(len(f))]
    sides = [(a, b) for a, b in sides if a != b]
    assert len(sides) == len(set(sides))
    assert {(b, a) for a, b in sides} == set(sides)
