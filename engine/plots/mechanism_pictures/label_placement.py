"""Names of bodies and joints in a picture of the mechanism. Each name is put at the nearest free place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.plots.style.palette import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from trunnion.plots.geometry.mechanism_geometry import Scenery
    from trunnion.plots.geometry.motion_and_view import Motion

NEAR = 0.02
"""Distance, divided by the picture's width. Places closer to each other than this distance share one label."""
LONGEST = 30
"""Largest count of characters in a line of several names."""
SIZES = {"joint": 7.0, "body": 8.0}
"""Font size of each kind of label, points."""
SPACING, PAD = 1.45, 1.0
"""SPACING: line height divided by font size. PAD: margin around a label, points. The margin is needed because a renderer rounds the
sizes of letters to pixels."""
RINGS, AROUND = 16, 16
"""Number of rings of candidate places around a named place, and number of places on each ring."""
RING = 9.0
"""Distance between rings, points."""
GAP = 8.0
"""Distance from the named place to the first ring, points."""
LED = 14.0
"""Distance, points. If a label is farther from the named place, a line joins label and place."""
ASIDE = 0.1
"""Weight, in the cost of a label's place, of the distance to the label's middle. The distance to its nearest edge has weight 1."""
HIDDEN, COVERED, OUTSIDE = 80.0, 60.0, 100.0
"""Costs of a label's place, in points of distance. HIDDEN: overlap with another label, per square of the font size. COVERED: cost
of each named place that the label covers. OUTSIDE: cost of a label that leaves the picture."""


@dataclass
class Name:
    """A label.

    at: the named place in the picture, points. text: one or more lines. kind: a key of SIZES. size: width and height, points.
    box: left, bottom, right and top, points; zero until the label is placed.
    """

    at: np.ndarray
    text: str
    kind: str
    size: np.ndarray
    box: np.ndarray


def label(axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, row: int) -> None:
    """Write the names of joints and bodies. Joints at one place share a label. A body's name is at the mass centre if there is
    room."""
    from matplotlib.patheffects import withStroke

    joints = [((view @ (p + r @ j.points[1]))[:2], j.name) for j in scene.joints for p, r in (moved.pose(j.parts[1], row),)]
    bodies = [((view @ moved.pose(i, row)[0])[:2], part.name) for i, part in enumerate(scene.parts)]
    points = 72.0 / axes.figure.dpi
    names = place_labels(
        [_name(points * axes.transData.transform(at), words, "body") for at, words in _gathered(axes, bodies)]
        + [_name(points * axes.transData.transform(at), words, "joint") for at, words in _gathered(axes, joints)],
        points * np.array(axes.bbox.extents),
    )
    look: dict[str, Any] = {"textcoords": "offset points", "zorder": 6, "ha": "center", "va": "center", "linespacing": 1.1}
    look["path_effects"] = [withStroke(linewidth=2, foreground="white", alpha=0.8)]
    for name in names:
        middle = (name.box[:2] + name.box[2:]) / 2
        far = _gap(name.box, name.at) > LED
        line = {"arrowstyle": "-", "color": "#777777", "lw": 0.5, "shrinkA": 0, "shrinkB": 1} if far else None
        color = INK if name.kind == "body" else "#444444"
        x, y = axes.transData.inverted().transform(name.at / points)
        axes.annotate(name.text, (x, y), xytext=middle - name.at, size=SIZES[name.kind], color=color, arrowprops=line, **look)


def place_labels(names: list[Name], frame: np.ndarray) -> list[Name]:
    """The names, each with its box at the place of lowest cost. Overlaps with the boxes of earlier names add to the cost. frame:
    left, bottom, right and top of the picture, points."""
    spots = np.array([n.at for n in names])
    for k, name in enumerate(names):
        options = _places(name)
        others = np.array([n.box for n in names[:k]]).reshape(-1, 4)
        cost = _gap(options, name.at) + ASIDE * np.linalg.norm((options[:, :2] + options[:, 2:]) / 2 - name.at, axis=1)
        cost += HIDDEN / (SIZES[name.kind] ** 2) * _shared(options, others).sum(axis=1)
        inside = (spots[None] > options[:, None, :2]) & (spots[None] < options[:, None, 2:])
        inside[:, k] &= name.kind == "joint"  # a body's name may cover the place that it names; a joint's name may not
        cost += COVERED * inside.all(axis=2).sum(axis=1)
        cost += OUTSIDE * ((options[:, :2] < frame[:2]) | (options[:, 2:] > frame[2:])).any(axis=1)
        name.box = options[int(np.argmin(cost))]
    return names


def _places(name: Name) -> np.ndarray:
    """Boxes to try for a name, nearest first. The boxes are the middle of a body, then rings around the named place."""
    angle = 2 * np.pi * np.arange(AROUND) / AROUND + np.pi / 4
    way = np.column_stack((np.cos(angle), np.sin(angle)))
    half = name.size / 2
    middles = [np.zeros((1, 2))] if name.kind == "body" else []
    middles += [way * ((half + GAP + k * RING) / np.fmax(np.abs(way), 1e-9)).min(axis=1, keepdims=True) for k in range(RINGS)]
    middle = name.at + np.concatenate(middles)
    return np.hstack((middle - half, middle + half))


def _gap(boxes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Distance of the position ``at`` from each box, in typographic points; 0 inside a box."""
    gap: np.ndarray = np.linalg.norm(np.clip(at, boxes[..., :2], boxes[..., 2:]) - at, axis=-1)
    return gap


def _shared(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Areas (len(a), len(b)) of the overlaps of boxes a[i] with boxes b[j]."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    return np.clip(high - low, 0.0, None).prod(axis=2)


def _name(at: np.ndarray, words: list[str], kind: str) -> Name:
    """A label with the size of its text, before it is placed."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    lines: list[str] = []
    for word in words:
        if lines and kind == "joint" and len(lines[-1]) + len(word) + 2 <= LONGEST:
            lines[-1] += f", {word}"
        else:
            lines.append(word)
    font = FontProperties(size=SIZES[kind])
    width = max(TextToPath().get_text_width_height_descent(line, font, False)[0] for line in lines)
    return Name(at, "\n".join(lines), kind, np.array([width, SPACING * SIZES[kind] * len(lines)]) + 2 * PAD, np.zeros(4))


def _gathered(axes: Axes, named: list[tuple[np.ndarray, str]]) -> list[tuple[np.ndarray, list[str]]]:
    """The names at each place of the picture. Places closer to each other than ``NEAR`` are merged."""
    left, right = axes.get_xlim()
    places: list[tuple[np.ndarray, list[str]]] = []
    for at, name in named:
        here = next((names for other, names in places if np.linalg.norm(at - other) < NEAR * (right - left)), None)
        if here is None:
            places.append((at, [name]))
        else:
            here.append(name)
    return places
