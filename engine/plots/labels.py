"""Names of bodies and joints in a picture of the mechanism, kept apart: each at the free place nearest to what it names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine.plots.palette import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from engine.plots.motion import Motion
    from engine.plots.scenery import Scenery

NEAR = 0.02
"""Part of the picture's width: what is closer to each other than that has one label."""
LONGEST = 30
"""Letters in a line of several names, at most."""
SIZES = {"joint": 7.0, "body": 8.0}
"""Letters, points."""
SPACING, PAD = 1.45, 1.0
"""Lines, × the size of their letters; points around them, for a renderer rounds letters to its own dots."""
RINGS, AROUND = 16, 16
"""Places that are tried around what is named: rings, and places on each."""
RING = 9.0
"""Points from one ring to the next."""
GAP = 8.0
"""Points from what is named to the first ring."""
LED = 14.0
"""Points from what is named to the nearest edge of its name: from there on a line leads to it."""
ASIDE = 0.1
"""How much the middle of a name counts beside its nearest edge."""
HIDDEN, COVERED, OUTSIDE = 80.0, 60.0, 100.0
"""What speaks against a place, in points of distance: a square of a letter shared with another name, a place named, the edge."""


@dataclass
class Name:
    """A label. at: the place in the picture that it names, points; text: one or more lines; kind: a key of SIZES; size: width and
    height, points; box: left, bottom, right and top, points, once it is placed."""

    at: np.ndarray
    text: str
    kind: str
    size: np.ndarray
    box: np.ndarray


def label(axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, row: int) -> None:
    """Write the names of joints (one label for all in one place) and of bodies, at their mass centres where there is room."""
    from matplotlib.patheffects import withStroke

    joints = [((view @ (p + r @ j.points[1]))[:2], j.name) for j in scene.joints for p, r in (moved.pose(j.parts[1], row),)]
    bodies = [((view @ moved.pose(i, row)[0])[:2], part.name) for i, part in enumerate(scene.parts)]
    points = 72.0 / axes.figure.dpi
    names = placed(
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


def placed(names: list[Name], frame: np.ndarray) -> list[Name]:
    """The names, each with its box at the best place that those before leave it. frame: left, bottom, right and top of the picture,
    points."""
    spots = np.array([n.at for n in names])
    for k, name in enumerate(names):
        options = _places(name)
        others = np.array([n.box for n in names[:k]]).reshape(-1, 4)
        cost = _gap(options, name.at) + ASIDE * np.linalg.norm((options[:, :2] + options[:, 2:]) / 2 - name.at, axis=1)
        cost += HIDDEN / (SIZES[name.kind] ** 2) * _shared(options, others).sum(axis=1)
        inside = (spots[None] > options[:, None, :2]) & (spots[None] < options[:, None, 2:])
        inside[:, k] &= name.kind == "joint"  # a body's own name may stand on it
        cost += COVERED * inside.all(axis=2).sum(axis=1)
        cost += OUTSIDE * ((options[:, :2] < frame[:2]) | (options[:, 2:] > frame[2:])).any(axis=1)
        name.box = options[int(np.argmin(cost))]
    return names


def _places(name: Name) -> np.ndarray:
    """Boxes that are tried, nearest first: a body's middle, then rings around the place."""
    angle = 2 * np.pi * np.arange(AROUND) / AROUND + np.pi / 4
    way = np.column_stack((np.cos(angle), np.sin(angle)))
    half = name.size / 2
    middles = [np.zeros((1, 2))] if name.kind == "body" else []
    middles += [way * ((half + GAP + k * RING) / np.fmax(np.abs(way), 1e-9)).min(axis=1, keepdims=True) for k in range(RINGS)]
    middle = name.at + np.concatenate(middles)
    return np.hstack((middle - half, middle + half))


def _gap(boxes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """How far a place is from each box, points; 0 inside."""
    gap: np.ndarray = np.linalg.norm(np.clip(at, boxes[..., :2], boxes[..., 2:]) - at, axis=-1)
    return gap


def _shared(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Areas that boxes a[i] and b[j] share, (len(a), len(b))."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    return np.clip(high - low, 0.0, None).prod(axis=2)


def _name(at: np.ndarray, words: list[str], kind: str) -> Name:
    """A label that is not placed yet, with the size of its text."""
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
    """The names in each place of the picture; what is near to one is in it."""
    left, right = axes.get_xlim()
    places: list[tuple[np.ndarray, list[str]]] = []
    for at, name in named:
        here = next((names for other, names in places if np.linalg.norm(at - other) < NEAR * (right - left)), None)
        if here is None:
            places.append((at, [name]))
        else:
            here.append(name)
    return places
