"""Spline through the points of a curve, as cubic pieces (theory, "Points on curves")."""

from __future__ import annotations

import numpy as np

from trunnion.scene.data_classes.joint_couplings import Curve as Given
from trunnion.system.construction.cam_profile_spline import spline_pieces
from trunnion.system.structure.coupling_joint_data import ENDLESS, Curve, CurveSegment, gauss_points
from trunnion.system.structure.parameter_table import Leaf


def curve(given: Given, roller: Leaf = 0.0) -> Curve:
    """The cubic spline through checked points. The spline's parameter is the length of the polygon through the points. The spline
    is periodic if the curve is closed. Otherwise, it has no curvature at its ends and continues straight beyond them."""
    points = np.array(given.points, float)
    if given.closed:
        points = np.vstack([points, points[:1]])
    u = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    both = [spline_pieces(u, x, given.closed)[0] for x in points.T]
    ways = np.concatenate([[0.0], np.cumsum([_length(p, q, h) for p, q, h in zip(*both, np.diff(u), strict=True)])])
    pieces = [
        CurveSegment(float(a), float(b), float(w), tuple(map(float, p)), tuple(map(float, q)))
        for a, b, w, p, q in zip(u[:-1], u[1:], ways[:-1], *both, strict=True)
    ]
    if given.closed:
        return Curve(tuple(pieces), float(u[-1]), float(ways[-1]), roller)
    last = _straight(both, -1, float(u[-1] - u[-2]), u[-1], ways[-1])
    return Curve((_straight(both, 0, 0.0, 0.0, 0.0), *pieces, last), 0.0, float(ways[-1]), roller)


def _straight(both: list[np.ndarray], k: int, h: float, at: float, way: float) -> CurveSegment:
    """A straight piece that continues the curve before its first piece (k = 0, h = 0) or after its last piece (k = −1). The
    straight piece meets piece k at the parameter distance h from the start of piece k. at: curve parameter of the meeting point;
    way: arc length there, m."""
    e2, e3 = ((c[0] + h * (c[1] + h * (c[2] + h * c[3])), c[1] + h * (2 * c[2] + 3 * h * c[3])) for c in (x[k] for x in both))
    return CurveSegment(float(at), 0.0 if k == 0 else ENDLESS, float(way), (*map(float, e2), 0.0, 0.0), (*map(float, e3), 0.0, 0.0))


def _length(p: np.ndarray, q: np.ndarray, h: float) -> float:
    points, weights = map(np.array, gauss_points())
    x = 0.5 * h * (points + 1)
    return float(0.5 * h * weights @ np.hypot(*(c[1] + x * (2 * c[2] + 3 * x * c[3]) for c in (p, q))))


def along(given: Given, stations: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions on a curve (n × 2), m, and unit tangents at these positions (n × 2). stations: number of positions for each spline
    piece."""
    real = [p for p in curve(given).pieces if p.start < p.end < ENDLESS]
    both = []
    for k, p in enumerate(real):
        ends = k == len(real) - 1 and not given.closed
        x = (p.end - p.start) * np.linspace(0.0, 1.0, stations + 1)[: None if ends else -1, None]
        a, b, c, d = (np.array(of) for of in zip(p.e2, p.e3, strict=True))
        both.append((a + x * (b + x * (c + x * d)), b + x * (2 * c + 3 * x * d)))
    place, way = (np.concatenate(x) for x in zip(*both, strict=True))
    return place, way / np.hypot(*way.T)[:, None]
