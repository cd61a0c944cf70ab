"""Frames of a film: bodies, joints, contacts and ground at an instant, drawn by depth, with labels."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.plots.animation.depth_raster import Sheet, Solid, halved, over
from trunnion.plots.geometry.mechanism_geometry import scenery
from trunnion.plots.geometry.meshes import Grain, Mesh, cylinder, placed, rotation_to
from trunnion.plots.geometry.motion_and_view import arrow_scale, frame_motion, motion, pressure_scale, rails, round_force
from trunnion.plots.mechanism_pictures.instant_picture import contact_places
from trunnion.plots.style.palette import GRID, INK, JOINT, OPEN, PRESSURE, STATES
from trunnion.simulation.results.result import Result

GRAIN = Grain(around=28, pieces=1)
SIZE = (720, 540)
"""Width and height, pixels."""
HIDDEN = 0.42
"""Opacity with which pins and contacts show through a body in front of them."""
HEAD = 44
"""Height of title and time, pixels."""
DOT = 5.0
"""Radius of a contact point, pixels."""
COILS = 9


def rgb(color: str) -> np.ndarray:
    """A colour's name as three numbers from 0 to 1."""
    from matplotlib.colors import to_rgb

    return np.array(to_rgb(color))


def ramp(x: float) -> np.ndarray:
    """Colour of a pressure. x: pressure divided by the largest pressure."""
    stops = [rgb(c) for c in PRESSURE]
    place = min(max(x, 0.0), 1.0) * (len(stops) - 1)
    k = min(int(place), len(stops) - 2)
    return stops[k] + (place - k) * (stops[k + 1] - stops[k])


class Frames:
    """Pictures of the run, seen as in ``first_view``, in parallel projection, over a round patch of ground."""

    def __init__(self, result: Result):
        self.result = result
        self.scene = scenery(result.scene, GRAIN)
        self.moved = motion(result, [p.name for p in self.scene.parts])
        self.framing = frame_motion(self.scene, self.moved)
        wide = self.framing.near if self.framing.follows else self.framing.wide
        self.ground = 0.6 * float(max(wide)) + self.scene.size
        self.scale = 2 * min(0.86 * SIZE[0] / wide[0], 0.86 * (SIZE[1] - HEAD) / wide[1])
        self.arrow, self.pressure = arrow_scale(result, self.scene), pressure_scale(result, self.scene)
        self.view, self.rails = self.framing.view, rails(result, self.scene)
        self.areas = {c.columns: c.patch.area for j in self.scene.joints for c in j.contacts}
        self.bodies = [(Solid.made(p.mesh), rgb(p.color)) for p in self.scene.parts]
        self.pins = [(part, Solid.made(mesh)) for j in self.scene.joints for part, mesh in j.pins]

    def at(self, time: float, speed: float = 1.0) -> np.ndarray:
        """The frame (height × width × 3 bytes) of the row nearest to a time, s."""
        row = int(np.argmin(np.abs(self.result.time - time)))
        body, inner = (Sheet(2 * SIZE[0], 2 * SIZE[1]) for _ in range(2))
        self._ground(body, row)
        for i, (s, color) in enumerate(self.bodies):
            self._solid(body, s, i, row, color)
        for part, s in self.pins:
            self._solid(inner, s, part, row, rgb(JOINT))
        self._threads(inner, row)
        dots = self._contacts(inner, row)
        picture = over(body, inner, HIDDEN)
        for spot, color in dots:
            _dot(picture, spot, color)
        return self._labelled(halved(picture), float(self.result.time[row]), speed)

    def spots(self, points: np.ndarray, row: int) -> np.ndarray:
        """The coordinates in the picture of points of the world (n × 3). The coordinates are right, down, and towards the viewer,
        in pixels of double resolution."""
        flat = self.scale * (np.asarray(points) - self._middle(row)) @ self.view.T
        return np.column_stack([SIZE[0] + flat[:, 0], SIZE[1] + HEAD - flat[:, 1], flat[:, 2]])

    def _middle(self, row: int) -> np.ndarray:
        """The point of the world in the middle of the picture."""
        return self.moved.positions[row].mean(axis=0) if self.framing.follows else self.framing.centre

    def _solid(self, sheet: Sheet, s: Solid, part: int, row: int, color: np.ndarray) -> None:
        p, r = self.moved.pose(part, row)
        sheet.solid(s, self.spots(s.vertices @ r.T + p, row), self.view @ r, color)

    def _ground(self, sheet: Sheet, row: int) -> None:
        up = self.scene.up
        a = self.view[0] - (self.view[0] @ up) * up
        a /= np.linalg.norm(a)
        b, step = np.cross(up, a), 10.0 ** np.ceil(np.log10(40 / self.scale))
        middle = self._middle(row)
        foot, ends = middle + (self.framing.floor - middle @ up) * up, []
        for along, across in ((a, b), (b, a)):
            for k in np.arange(np.ceil((foot @ across - self.ground) / step), (foot @ across + self.ground) / step):
                half = np.sqrt(max(self.ground**2 - (k * step - foot @ across) ** 2, 0.0))
                at = foot + (k * step - foot @ across) * across
                ends += [[at - half * along, at + half * along]]
        sheet.lines(self.spots(np.reshape(ends, (-1, 3)), row).reshape(-1, 2, 3), rgb(GRID), 2)
        sheet.depth[:] = -np.inf

    def _threads(self, sheet: Sheet, row: int) -> None:
        """Draw springs and dampers as coils, rods as lines, and the lines of sliding joints as dashes."""
        for k, ends in enumerate((*self.scene.springs, *self.scene.rods)):
            p, q = (r @ point + x for (x, r), point in ((self.moved.pose(part, row), point) for part, point in ends))
            spots = coil(p, q, self.scene.size) if k < len(self.scene.springs) else np.array([p, q])
            self._line(sheet, spots, row, rgb(INK))
        for part, p, q in self.rails:
            x, r = self.moved.pose(part, row)
            cuts = np.linspace(0, 1, 2 * max(2, int(np.linalg.norm(q - p) / (0.12 * self.scene.size))))
            spots = self.spots((p + cuts[:, None] * (q - p)) @ r.T + x, row)
            sheet.lines(spots.reshape(-1, 2, 3), rgb(JOINT))

    def _line(self, sheet: Sheet, points: np.ndarray, row: int, color: np.ndarray) -> None:
        spots = self.spots(points, row)
        sheet.lines(np.stack([spots[:-1], spots[1:]], axis=1), color, 3)

    def _contacts(self, sheet: Sheet, row: int) -> Iterable[tuple[np.ndarray, np.ndarray]]:
        """Draw the arrows of the normal forces on the pins. Returns the place and the colour of each contact point."""
        out = []
        thick = max(0.011 * self.scene.size, 2.6 / self.scale)
        for columns, point, normal, force, state in contact_places(self.scene, self.moved, self.result, row):
            long = force * self.arrow
            color = ramp(force / (self.areas[columns] * self.pressure)) if self.areas[columns] * self.pressure > 0 else ramp(0.0)
            for s in arrow(long, min(thick, 0.2 * long)) if long > 0 else ():
                turn = rotation_to(normal)
                sheet.solid(s, self.spots(s.vertices @ turn.T + point, row), self.view @ turn, color, edges=False)
            out.append((self.spots(point[None], row)[0, :2], rgb(STATES.get(state, OPEN)[0])))
        return out

    def _labelled(self, picture: np.ndarray, time: float, speed: float) -> np.ndarray:
        """The picture with title, time and the scale of arrows."""
        from PIL import Image, ImageDraw

        image = Image.fromarray(picture)
        draw = ImageDraw.Draw(image)
        bold, plain = font(True, 15), font(False, 12)
        draw.text((12, 6), self.result.scene.title or self.result.scene.name, INK, bold)
        pace = "" if speed == 1.0 else f"   × {speed:.3g}"
        draw.text((12, 26), f"t = {time:.4g} s{pace}", "#555555", plain)
        if self.arrow > 0:
            force = round_force(self.arrow, self.scene.size)
            words = f"arrow: normal force on the pin; {force:g} N is drawn {force * self.arrow:.3g} m long"
            draw.text((12, SIZE[1] - 20), words, "#555555", plain)
        return np.asarray(image)


@lru_cache(maxsize=8)
def font(bold: bool, size: int) -> Any:
    """The font that comes with matplotlib."""
    import matplotlib as mpl
    from PIL import ImageFont

    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / f"DejaVuSans{'-Bold' if bold else ''}.ttf"), size)


def coil(p: np.ndarray, q: np.ndarray, size: float) -> np.ndarray:
    """The points of a coil with straight ends, between two given points."""
    d = q - p
    length = float(np.linalg.norm(d))
    _, u, v = rotation_to(d / max(length, 1e-300)).T
    k = np.linspace(0, 1, 20 * COILS + 1)
    swell = min(0.09 * length, 0.06 * size) * np.minimum(1, np.minimum(k, 1 - k) * 2 * COILS)
    turn = 2 * np.pi * COILS * k
    around = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    return np.vstack([p, p + (0.12 + 0.76 * k)[:, None] * d + swell[:, None] * around, q])


def arrow(long: float, slim: float) -> tuple[Solid, Solid]:
    """The head and the shaft of an arrow along x, from x = ``long``, m, to the origin."""
    head = min(0.45 * long, 5 * slim)
    shaft = cylinder(slim, long - head, 0, Grain(12, 1))
    turn = 2 * np.pi * np.arange(12) / 12
    ring = np.column_stack([np.full(12, head), 2.3 * slim * np.cos(turn), 2.3 * slim * np.sin(turn)])
    sides = tuple((0, 1 + (k + 1) % 12, 1 + k) for k in range(12))
    cone = Mesh(np.vstack([np.zeros(3), ring]), (*sides, tuple(range(1, 13))), (0,) * 13)
    return Solid.made(cone), Solid.made(placed(shaft, np.eye(3), np.array([(long + head) / 2, 0, 0])))


def _dot(picture: np.ndarray, spot: np.ndarray, color: np.ndarray) -> None:
    """Draw a contact point: a disc with a white rim."""
    rim = int(2 * DOT) + 2
    x, y = int(spot[0]), int(spot[1])
    rows, columns = slice(max(0, y - rim), y + rim + 1), slice(max(0, x - rim), x + rim + 1)
    part = picture[rows, columns]
    across, down = np.arange(part.shape[1]) + columns.start, np.arange(part.shape[0]) + rows.start
    away = np.hypot(across + 0.5 - spot[0], (down + 0.5 - spot[1])[:, None])
    part[away < 2 * DOT] = 1.0
    part[away < 1.4 * DOT] = color
