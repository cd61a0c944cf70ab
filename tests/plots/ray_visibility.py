"""The body that must be visible at a place of the picture, found by rays cast through every triangle. Also the number of places
that show another body."""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tests.plots.webgl_browser import Opened

WINDOW = 7
"""Size of the square of pixels around a place that must all show the same body if the place is to count, because edges are drawn
over the bodies."""
ALIKE = 0.035
"""Hues of two bodies differ by more than this; light and gloss change a body's own hue by less."""

HATCHED = 45.0
"""Colour difference between the lines of a section and the area between them (an edge of a body differs by more)."""


def rays(cam: dict[str, Any], spots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(start, direction) of the lines of sight through pixels (n × 2). The function inverts the page's matrix itself."""
    inverse = np.linalg.inv(np.array(cam["matrix"], float).reshape(4, 4).T)
    flat = np.column_stack([2 * spots[:, 0] / cam["w"] - 1, 1 - 2 * spots[:, 1] / cam["h"]])
    ends = []
    for depth in (-1.0, 1.0):
        p = np.column_stack([flat, np.full(len(flat), depth), np.ones(len(flat))]) @ inverse.T
        ends.append(p[:, :3] / p[:, 3:])
    return ends[0], ends[1] - ends[0]


AT_ONCE = 64
"""Number of triangles in one matrix product with all rays near a part. More triangles would exceed the processor's caches."""


def hits(page: Opened, m: dict[str, Any], begin: np.ndarray, along: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """(part, distance along each ray to its nearest triangle ahead, ∞ without such a triangle, number of its triangles ahead)."""
    moment = np.cross(begin, along)
    length = np.linalg.norm(along, axis=1)
    for i, part in enumerate(page.ask("run.parts.map((p) => ({v: run.meshes[p.mesh].v, f: run.meshes[p.mesh].f}))")):
        spots = np.reshape(part["v"], (-1, 3)) @ np.reshape(m["poses"][i]["r"], (3, 3)).T + m["poses"][i]["p"]
        corners = spots[[[f[0], f[k], f[k + 1]] for f in part["f"] for k in range(1, len(f) - 1)]]
        middle = spots.mean(axis=0)
        radius = 1.001 * np.linalg.norm(spots - middle, axis=1).max()
        near = np.linalg.norm(np.cross(begin - middle, along), axis=1) <= radius * length  # other rays miss the part
        first, number = np.full(len(begin), np.inf), np.zeros(len(begin), int)
        for k in range(0, len(corners), AT_ONCE):
            t = cut_at(corners[k : k + AT_ONCE], begin[near], along[near], moment[near])
            first[near] = np.minimum(first[near], t.min(axis=1))
            number[near] += np.isfinite(t).sum(axis=1)
        yield i, first, number


def cut_at(corners: np.ndarray, begin: np.ndarray, along: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """Distance along each ray to each triangle ahead; ∞ if the ray misses the triangle (rays × triangles). b × d is the moment of a
    ray. The coordinates of a ray in a triangle (a, u, v) follow from v · (b − a) × d = v · (b × d) − d · (v × a). The second
    coordinate has u in place of v."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(u, v)
    det = -along @ normal.T
    with np.errstate(all="ignore"):
        t = (begin @ normal.T - np.sum(a * normal, axis=1)) / det
        s = (moment @ v.T - along @ np.cross(v, a).T) / det
        r = (along @ np.cross(u, a).T - moment @ u.T) / det
        inner = (s >= 0) & (r >= 0) & (s + r <= 1)
    return np.where((det != 0) & (t > 0) & inner, t, np.inf)


def nearest(firsts: list[np.ndarray]) -> np.ndarray:
    """The part that each ray meets first (−1: none)."""
    return np.where(np.isfinite(firsts).any(axis=0), np.argmin(firsts, axis=0), -1)


def first_hit(page: Opened, m: dict[str, Any], begin: np.ndarray, along: np.ndarray) -> np.ndarray:
    """The part that each ray meets first (−1: none), found by intersection with every triangle."""
    return nearest([first for _, first, _ in hits(page, m, begin, along)])


def behind_the_cut(page: Opened, m: dict[str, Any], begin: np.ndarray, along: np.ndarray, cut: np.ndarray) -> np.ndarray:
    """The part that each ray shows when everything beyond the plane n·x = d, cut = (n, d), is removed. The part contains the ray's
    point in the plane if the ray has an odd number of this part's faces ahead (−2: several parts). If no part contains the point,
    the result is the part that the ray meets first."""
    with np.errstate(all="ignore"):
        start = np.fmax((cut[3] - begin @ cut[:3]) / (along @ cut[:3]), 0.0)
    begin = begin + start[:, None] * along
    met = list(hits(page, m, begin, along))
    within = np.array([number % 2 == 1 for _, _, number in met])
    first = nearest([first for _, first, _ in met])
    return np.where(within.sum(axis=0) > 1, -2, np.where(within.any(axis=0), within.argmax(axis=0), first))


def hue(rgb: np.ndarray) -> float:
    return colorsys.rgb_to_hsv(*(rgb[:3] / 255))[0]


def compared(page: Opened, shown: Callable[..., np.ndarray], grain: float = 25.0) -> tuple[int, int]:
    """(number of checked places, number of places whose body differs from the body ``shown`` by the rays). The function checks only
    places with one body around them whose colour changes by at most ``grain``."""
    picture, cam, m = page.pixels(), page.ask("camera(moment(clock.t))"), page.ask("moment(clock.t)")
    hues = [hue(np.array([int(c[k : k + 2], 16) for k in (1, 3, 5)])) for c in page.ask("run.parts.map((p) => p.color)")]
    x, y = np.meshgrid(np.arange(60, cam["w"] - 60, 9), np.arange(60, cam["h"] - 140, 9))
    centres = np.column_stack([x.ravel(), y.ravel()])
    around = [shown(page, m, *rays(cam, centres + 0.5 + np.array(d))) for d in ((-WINDOW, -WINDOW), (WINDOW, WINDOW), (0, 0))]
    sure = (around[0] == around[1]) & (around[1] == around[2]) & (around[2] >= 0)
    seen = wrong = 0
    for (px, py), part in zip(centres[sure], around[2][sure], strict=True):
        spot = picture[py - 3 : py + 4, px - 3 : px + 4, :3].reshape(-1, 3)
        if np.ptp(spot, axis=0).max() > grain:  # an edge of the body crosses this place
            continue
        found = hue(np.median(spot, axis=0))
        away = [min(abs(found - h), 1 - abs(found - h)) for h in hues]
        seen += 1
        wrong += int(away[part] > ALIKE or int(np.argmin(away)) != part)
    return seen, wrong
