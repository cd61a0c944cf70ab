"""Mass properties of a body: explicit, or computed from a solid shape and its density or mass."""

from __future__ import annotations

import math

from trunnion.scene.data_classes.bodies import AxialInertia, Body, Cylinder, Inertias
from trunnion.scene.queries.body_poses_and_joint_sides import vector

Triple = tuple[float, float, float]
Matrix = tuple[Triple, Triple, Triple]


def mass_properties(body: Body) -> tuple[float, Triple, Matrix]:
    """(mass, kg; mass centre in the body's frame, m; inertia about the mass centre in the body's axes, 3×3, kg m²) of a checked
    body."""
    x, y, z = body.center
    center = (float(x), float(y), float(z))
    if body.inertia is not None:
        if body.mass is None:
            raise ValueError("an explicit inertia needs a mass")
        return float(body.mass), center, matrix(body.inertia)
    volume, gyration = volume_and_moments(body)
    if body.mass is None and body.density is None:
        raise ValueError("a shape needs a density or a mass")
    m = float(body.mass) if body.mass is not None else float(body.density or 0.0) * volume
    a, b, c = (m * k for k in gyration)
    return m, center, ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))


def matrix(inertia: Inertias) -> Matrix:
    """The symmetric 3×3 inertia matrix of (xx, yy, zz) or (xx, yy, zz, xy, xz, yz). For an axial inertia J about the unit vector a,
    the matrix is J a aᵀ."""
    if isinstance(inertia, AxialInertia):
        a = vector(inertia.axis)
        scale = float(inertia.axial) / (math.fsum(c * c for c in a) or 1.0)
        (xx, yy, zz), (xy, xz, yz) = (scale * c * c for c in a), (scale * a[i] * a[k] for i, k in ((0, 1), (0, 2), (1, 2)))
        return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)
    xx, yy, zz, xy, xz, yz = (float(v) for v in (*inertia, 0.0, 0.0, 0.0)[:6])
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def volume_and_moments(body: Body) -> tuple[float, Triple]:
    """(volume, m³; moments of inertia xx, yy, zz about the centre divided by the mass, m²) of the body's shape."""
    if body.box is not None:
        a, b, c = (float(v) for v in body.box)
        return a * b * c, ((b * b + c * c) / 12, (a * a + c * c) / 12, (a * a + b * b) / 12)
    if body.cylinder is not None:
        return _cylinder(body.cylinder)
    if body.sphere is not None:
        r = float(body.sphere)
        return 4 / 3 * math.pi * (r * r * r), (0.4 * r * r, 0.4 * r * r, 0.4 * r * r)
    raise ValueError("a body without a shape needs mass and inertia")


def _cylinder(c: Cylinder) -> tuple[float, Triple]:
    r, h = float(c.radius), float(c.length)
    k = [(3 * r * r + h * h) / 12] * 3
    k["xyz".index(c.axis[-1])] = r * r / 2
    return math.pi * r * r * h, (k[0], k[1], k[2])


def principal_moments(m: Matrix) -> Triple:
    """Eigenvalues of a symmetric 3×3 matrix in increasing order."""
    import numpy as np

    low, mid, high = map(float, np.linalg.eigvalsh(m))
    return low, mid, high
