"""Figures show the quantities that they name, with units. Figures have no false lines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Annotation, Text

from tests.engine.stick_slip.test_active_set_many_pairs import links
from trunnion.basics.errors import SceneError
from trunnion.plots import figure, mechanism, save_figure
from trunnion.plots.curves.angle_curves import broken, rotation_vector
from trunnion.plots.curves.curve_page import thousands, ylabel
from trunnion.plots.curves.panel_selection import Curve, Panel, sections
from trunnion.scene import load_scene
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate


def axes_of(result: Result) -> dict:
    return {a.get_title(loc="left"): a for a in figure(result).axes}


def test_a_wrap_is_no_vertical_line() -> None:
    t = np.linspace(0, 1, 101)
    _, degrees = broken(t, 4 * np.pi * t)
    steps = np.abs(np.diff(degrees))
    assert np.nanmax(steps) < 10
    assert np.isnan(degrees).sum() == 2
    assert np.nanmax(degrees) == pytest.approx(180)
    assert np.nanmin(degrees) == pytest.approx(-180)


def test_a_jump_is_a_gap_and_nothing_is_lost() -> None:
    t = np.linspace(0, 1, 11)
    angle = np.where(t < 0.55, 0.2, 0.9)
    times, degrees = broken(t, angle, [0.55])
    assert np.isnan(degrees).sum() == 1
    np.testing.assert_allclose(degrees[~np.isnan(degrees)], np.degrees(angle))
    assert np.all(np.diff(times) >= 0)


def test_rotation_vectors_continue_through_half_a_turn() -> None:
    angle = np.linspace(0, 1.5 * np.pi, 50)
    q = np.column_stack([np.cos(angle / 2), 0 * angle, np.sin(angle / 2), 0 * angle])
    q[20:] *= -1
    np.testing.assert_allclose(rotation_vector(q)[:, 1], angle, atol=1e-12)


def test_the_page_of_the_ball_pendulum_shows_the_papers_curves(pendulum: Result) -> None:
    axes = axes_of(pendulum)
    wanted = {
        "Friction torque of ball": "friction torque, N m",
        "Angular acceleration of ball": "angular acceleration, rad/s²",
        "Where pin and bearing touch in ball": "contact angle, °",
        "Normal contact forces in ball": "normal force, N",
        "Energy": "energy, J",
    }
    for title, label in wanted.items():
        assert axes[title].get_ylabel() == label
        assert axes[title].get_xlabel() == "time, s"


def test_components_that_vanish_are_not_drawn(pendulum: Result) -> None:
    lines = axes_of(pendulum)["Friction torque of ball"].get_lines()
    names = [line.get_label() for line in lines if not line.get_label().startswith("_")]
    assert names == ["friction.torque[2]"]


def test_every_reversal_is_marked_on_the_joints_axes(pendulum: Result) -> None:
    axes = axes_of(pendulum)
    upright = [line for line in axes["Friction torque of ball"].get_lines() if len(line.get_xdata()) == 2]
    assert [line.get_xdata()[0] for line in upright] == [e.time for e in pendulum.events]
    assert not [line for line in axes["Energy"].get_lines() if len(line.get_xdata()) == 2]


def test_every_jump_of_the_contact_angle_has_its_two_dots(pendulum: Result) -> None:
    lines = axes_of(pendulum)["Where pin and bearing touch in ball"].get_lines()
    dots = [(line.get_xdata()[0], line.get_ydata()[0]) for line in lines if line.get_marker() == "o"]
    expected = [(e.time, np.degrees(a[0])) for e in pendulum.events for a in (e.before, e.after)]
    np.testing.assert_allclose(dots, expected)


def test_no_line_of_a_contact_angle_is_steep(pendulum: Result) -> None:
    for line in axes_of(pendulum)["Where pin and bearing touch in ball"].get_lines():
        if len(line.get_xdata()) > 2:
            assert np.nanmax(np.abs(np.diff(line.get_ydata()))) < 20


def test_small_numbers_are_shown_with_their_power_of_ten() -> None:
    t = np.linspace(0, 1, 5)
    panel = Panel("x", "residual", "J", (Curve("a", t, 3.2e-7 * t),))
    assert thousands(panel) == -9
    assert ylabel(panel, -9) == "residual, 10⁻⁹ J"


def test_the_double_pendulum_has_a_section_for_each_frictional_joint(double: Result) -> None:
    headings = [s.heading for s in sections(double)]
    assert headings == ["guide (cylindrical)", "cross (universal)", "Motion and energy"]
    titles = {p.title: p for s in sections(double) for p in s.panels}
    assert titles["Friction force of guide"].unit == "N"
    assert len(titles["Normal contact forces in cross"].curves) == 4


def test_prescribed_and_dependent_coordinates_are_left_out(slider: Result) -> None:
    drawn = {c.label for s in sections(slider) for p in s.panels for c in p.curves}
    assert "slider_pin.q[1]" in drawn
    assert "guide.qdd[1]" in drawn
    assert not any(name.startswith(("crank_pivot.q", "crank_pin.")) for name in drawn)
    assert "crank_pivot.drive.effort[1]" in drawn  # the effort of the drive is not a coordinate


def test_a_result_with_few_columns_still_makes_a_page(pendulum: Result) -> None:
    few = replace(pendulum, data=pendulum.data[:, :2], columns=pendulum.columns[:1])
    assert figure(few).axes == []


def test_part_of_a_run_can_be_shown(pendulum: Result) -> None:
    axes = figure(pendulum, between=(1.0, 2.0)).axes[0]
    assert axes.get_xlim() == (1.0, 2.0)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_same_run_draws_the_same_bytes(pendulum: Result, tmp_path: Path, suffix: str) -> None:
    a, b = (save_figure(figure(pendulum), tmp_path / f"{n}{suffix}").read_bytes() for n in "ab")
    assert a == b
    assert len(a) > 5000


def test_a_figure_with_another_suffix_is_refused(pendulum: Result, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"\.png or \.svg or \.pdf"):
        save_figure(figure(pendulum), tmp_path / "x.bmp")


def test_a_picture_of_the_mechanism_shows_contacts_and_states_the_scale(slider: Result, tmp_path: Path) -> None:
    picture = mechanism(slider, 0.2)
    words = " ".join(t.get_text() for t in picture.axes[0].texts)
    assert "normal force on the pin" in words
    assert {"crank", "rod", "slider"} <= set(words.split())
    dots = [line for line in picture.axes[0].get_lines() if line.get_marker() == "o"]
    assert len(dots) == 2
    save_figure(picture, tmp_path / "m.png")


def test_efforts_of_joints_and_springs_between_points_are_drawn() -> None:
    titles = {p.title: {c.label for c in p.curves} for s in sections(simulate("andrews", until=0.002)) for p in s.panels}
    assert titles["Torques along the joints' freedoms"] == {"beta.effort[1]"}
    assert titles["Forces along the joints' freedoms and of springs"] == {"spring.force"}
    assert titles["Lengths of springs"] == {"spring.length"}


def test_a_figure_names_the_joints_that_it_leaves_out_and_how_to_see_them() -> None:
    r = simulate(links(7, 0, "revolute", apart=False), until=1e-3)
    rubbing = [n for n, j in r.scene.joints.items() if j.friction is not None]
    [note] = [s.heading for s in sections(r) if "not drawn" in s.heading]
    assert all(n in note for n in rubbing[4:7])
    only = simulate(r.scene, until=1e-3, outputs=(f"{rubbing[5]}.*",))
    seen = [s.heading.split()[0] for s in sections(only)]
    assert rubbing[5] in seen
    assert not any("not drawn" in s.heading for s in sections(r, rubbing))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", ["stewart_platform", "wishbone_corner", "scissor_lift", "toggle_press", "andrews"])
def test_no_name_in_a_picture_covers_another_or_leaves_it(name: str) -> None:
    """The test uses the boxes of texts that the renderer itself gives."""
    drawn = mechanism(load_scene(name))
    renderer = FigureCanvasAgg(drawn).get_renderer()
    boxes = []
    for text in (t for t in drawn.axes[0].texts if isinstance(t, Annotation) and t.get_text()):
        text.update_positions(renderer)
        boxes.append(Text.get_window_extent(text, renderer).extents)
    at = np.array(boxes)
    low, high = np.maximum(at[:, None, :2], at[None, :, :2]), np.minimum(at[:, None, 2:], at[None, :, 2:])
    assert np.argwhere((low < high).all(axis=2) & ~np.eye(len(at), dtype=bool)).tolist() == []
    left, bottom, right, top = drawn.axes[0].bbox.extents
    assert (at >= [left, bottom, left, bottom]).all()
    assert (at <= [right, top, right, top]).all()
