"""Films agree with the page in depth, positions of columns and duration, in every available format."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import trunnion.basics.atomic_files as files
from trunnion.basics.atomic_files import destination_problems
from trunnion.basics.errors import SceneError
from trunnion.plots import animate
from trunnion.plots.animation.depth_raster import Sheet, Solid, halved, over
from trunnion.plots.animation.film import FPS, USUAL, film, pace
from trunnion.plots.animation.film_frames import SIZE, Frames
from trunnion.plots.geometry.meshes import FINE, box, placed, sphere
from trunnion.plots.mechanism_pictures.instant_picture import contact_places
from trunnion.plots.style.palette import STATES
from trunnion.simulation.results.result import Result

RED, BLUE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def drawn(*shapes: tuple[Solid, np.ndarray, float]) -> np.ndarray:
    """Shapes at depths (pixels), in the given order, in the middle of a sheet."""
    sheet = Sheet(80, 80)
    for s, color, depth in shapes:
        sheet.solid(s, s.vertices * [1, -1, 1] + [40, 40, depth], np.eye(3), color)
    return sheet.shade


BALL, BLOCK = Solid.made(sphere(20.0, 40)), Solid.made(box(50.0, 30.0, 10.0, FINE))


@pytest.mark.parametrize("near", [0, 1])
def test_the_nearer_of_two_hides_the_other_in_whatever_order_they_are_drawn(near: int) -> None:
    shapes = [(BALL, RED, 60.0 if near == 0 else 0.0), (BLOCK, BLUE, 60.0 if near == 1 else 0.0)]
    pictures = [drawn(*shapes), drawn(*reversed(shapes))]
    np.testing.assert_array_equal(*pictures)
    assert np.argmax(pictures[0][40, 40]) == (0, 2)[near]


def test_bodies_that_cross_hide_each_other_along_their_line_of_crossing() -> None:
    """Two plates intersect in an X, seen along the line of intersection. Each plate hides the other plate on one side."""
    plates = [Solid.made(placed(box(60.0, 40.0, 1.0, FINE), turned(a), np.zeros(3))) for a in (0.5, -0.5)]
    picture = drawn((plates[0], RED, 0.0), (plates[1], BLUE, 0.0))
    left, right = picture[40, 28], picture[40, 52]
    assert {int(np.argmax(left)), int(np.argmax(right))} == {0, 2}


def turned(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])


def test_a_ball_covers_the_pixels_of_its_circle() -> None:
    """The covered pixels agree with the circle, except for the line drawn around the ball (two pixels) and the facets of forty
    sides."""
    picture = drawn((BALL, RED, 0.0))
    covered = float((picture.min(axis=2) < 0.9).sum())
    assert np.pi * 19.5**2 < covered < np.pi * 21.5**2


def test_a_hidden_body_shows_faintly_and_a_visible_body_fully() -> None:
    below, above = Sheet(80, 80), Sheet(80, 80)
    below.solid(BLOCK, BLOCK.vertices * [1, -1, 1] + [40, 40, 0], np.eye(3), BLUE)
    above.solid(Solid.made(sphere(4.0)), Solid.made(sphere(4.0)).vertices * [1, -1, 1] + [40, 40, -20], np.eye(3), RED)
    behind = over(below, above, 0.4)[40, 40]
    above.depth += 100
    before = over(below, above, 0.4)[40, 40]
    assert np.argmax(behind) == 2
    assert behind[0] > 0.2
    assert np.argmax(before) == 0
    np.testing.assert_array_equal(halved(np.ones((4, 6, 3), np.float32)), np.full((2, 3, 3), 255))


def test_contact_points_are_where_the_columns_put_them(swing: Result) -> None:
    """In the picture, a contact point is the projection of the ball's radius times the normal in the table. (The ball's centre is
    the origin.)"""
    frames = Frames(swing)
    for row in (15, 40, 90):
        n = np.array([swing[f"ball.contact[1].normal[{k}]"][row] for k in (1, 2, 3)])
        flat = (0.05 * n - frames.framing.centre) @ frames.view.T * frames.scale / 2
        x, y = SIZE[0] / 2 + flat[0], SIZE[1] / 2 + 22 - flat[1]
        picture = frames.at(float(swing.time[row]))
        state = next(s for *_, s in contact_places(frames.scene, frames.moved, swing, row))
        wanted = [int(STATES[state][0][k : k + 2], 16) for k in (1, 3, 5)]
        np.testing.assert_allclose(picture[int(y), int(x)], wanted, atol=6)


def test_short_and_long_runs_last_the_usual_time(swing: Result) -> None:
    times, speed = pace(swing)
    assert (len(times), speed) == (3 * FPS, 1.0)
    quick = replace(swing, data=np.column_stack([swing.data[:, 0] / 1000, swing.data[:, 1:]]))
    times, speed = pace(quick)
    assert len(times) == USUAL * FPS
    assert speed == pytest.approx(0.003 / USUAL)
    assert times[-1] == pytest.approx(0.003)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_a_film_has_its_frames_and_its_time(suffix: str, swing: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trunnion.plots.animation.film.FPS", 2)
    told: list[float] = []
    file = animate(swing, tmp_path / f"f{suffix}", lambda t, end: told.append(t / end))
    with Image.open(file) as picture:
        assert picture.size == SIZE
        assert picture.n_frames == len(told) == 6
        picture.seek(3)
        assert np.ptp(np.asarray(picture.convert("RGB"), float), axis=2).max() > 60
        if suffix == ".gif":
            assert picture.info["duration"] == 500
            assert picture.info["loop"] == 0
    assert told[-1] == 1.0
    assert [f.name for f in tmp_path.iterdir()] == [file.name]


@pytest.mark.skipif(importlib.util.find_spec("av") is None, reason="needs the extra video")
def test_a_film_is_written_as_mp4(swing: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import av

    monkeypatch.setattr("trunnion.plots.animation.film.FPS", 2)
    film(swing, tmp_path / "f.mp4")
    with av.open(str(tmp_path / "f.mp4")) as container:
        frames = [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]
    assert len(frames) == 6
    wanted = Frames(swing).at(0.0).astype(float)
    assert np.abs(frames[0] - wanted).mean() < 4.0  # compression changes colours, which go up to 255, by less than 4


def test_mp4_without_its_package_is_refused_before_any_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "there", lambda module: module != "av")
    found = destination_problems(tmp_path / "f.mp4", (".html", ".gif", ".mp4"), "--animate")
    assert "av" in found[0].what
    assert "pip install 'trunnion[video]'" in found[0].hint


def test_a_film_of_a_result_without_positions_is_a_problem(swing: Result, tmp_path: Path) -> None:
    few = replace(swing, data=swing.data[:, :2], columns=swing.columns[:1])
    with pytest.raises(SceneError, match="orientation"):
        animate(few, tmp_path / "x.gif")
    assert list(tmp_path.iterdir()) == []
