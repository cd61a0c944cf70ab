"""Packed surfaces of bodies as ``trunnion import`` writes them: triangle meshes with points on a fine grid, compressed to text."""

from __future__ import annotations

import base64
import binascii
import struct
import zlib
from collections.abc import Sequence

HEAD = struct.Struct("<HH6f")
"""Header: numbers of points and of triangles; lower and upper bounds of the points along x, y, z, m."""
GRID = 65535
"""Number of grid steps along each axis; also the largest number of points and of triangles."""
LONGEST = 1_000_000
"""Largest number of characters of a packed surface."""
Triple = tuple[float, float, float]


def packed(points: Sequence[Sequence[float]], faces: Sequence[Sequence[int]]) -> str:
    """The text of a surface from points (n × 3), m, in the body's frame, and triangles ``faces`` (m × 3). The corners of a
    triangle are counter-clockwise seen from outside."""
    low = [min(p[k] for p in points) for k in range(3)]
    high = [max(p[k] for p in points) for k in range(3)]
    steps = [GRID / (b - a) if b > a else 0.0 for a, b in zip(low, high, strict=True)]
    spots = [round((p[k] - low[k]) * steps[k]) for p in points for k in range(3)]
    return _text(low, high, spots, [i for f in faces for i in f])


def _text(low: Sequence[float], high: Sequence[float], spots: Sequence[int], corners: Sequence[int]) -> str:
    body = struct.pack(f"<{len(spots) + len(corners)}H", *spots, *corners)
    raw = HEAD.pack(len(spots) // 3, len(corners) // 3, *low, *high) + body
    return base64.b64encode(zlib.compress(raw, 9)).decode("ascii")


def _read(text: str) -> tuple[list[float], list[float], list[int], list[int]]:
    if len(text) > LONGEST:
        raise ValueError(f"longer than {LONGEST} characters")
    try:
        bomb = zlib.decompressobj()
        raw = bomb.decompress(base64.b64decode(text, validate=True), HEAD.size + 12 * GRID)
        points, faces, *bounds = HEAD.unpack_from(raw)
        values = struct.unpack_from(f"<{3 * (points + faces)}H", raw, HEAD.size)
    except (binascii.Error, zlib.error, struct.error, ValueError) as e:
        raise ValueError(str(e)) from e
    spots, corners = list(values[: 3 * points]), list(values[3 * points :])
    if not faces or max(corners) >= points or not all(abs(b) < 1e9 for b in bounds):
        raise ValueError("its triangles refer to missing points")
    return bounds[:3], bounds[3:], spots, corners


def unpacked(text: str) -> tuple[list[Triple], list[tuple[int, int, int]]]:
    """(points, m; triangles) of a packed surface. Raises ValueError for invalid text."""
    low, high, spots, corners = _read(text)
    at = [[low[k] + s * (high[k] - low[k]) / GRID for s in spots[k::3]] for k in range(3)]
    points = list(zip(*at, strict=True))
    return points, list(zip(corners[::3], corners[1::3], corners[2::3], strict=True))


def mirrored(text: str, axis: int) -> str:
    """The surface reflected along an axis of its frame."""
    low, high, spots, corners = _read(text)
    low[axis], high[axis] = -high[axis], -low[axis]
    spots[axis::3] = [GRID - s for s in spots[axis::3]]
    corners[1::3], corners[2::3] = corners[2::3], corners[1::3]
    return _text(low, high, spots, corners)
