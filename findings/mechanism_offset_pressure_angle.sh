#!/usr/bin/env bash
# `Cam.get_base_circle` of the package mechanism returns the base circle for which the pressure angle of a roller follower reaches a
# given limit. For a follower with an offset e, the distance from the axis to the roller centre along the follower is
# s + sqrt((Rb + Rf)^2 - e^2). The package computes s + sqrt((Rb + Rf)^2 + e^2). So it finds a base circle that is too small, and
# the pressure angle of the cam exceeds the limit. Without an offset, the result is right.
# Seen: mechanism 1.1.10, rise 20 mm, roller 5 mm, limit 30 deg: 30.00 deg without offset; 34.04 deg with an offset of 10 mm.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --no-compile "mechanism==1.1.10" "numpy==2.2.6" "scipy==1.15.3" "matplotlib==3.10.3"
MPLBACKEND=Agg "$folder/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
from mechanism import Cam

LIMIT, ROLLER = 30.0, 0.005
cam = Cam(motion=[("Rise", 0.02, 100), ("Fall", 0.02, 260)], degrees=True, omega=1.0, h=1e-3)


def largest_angle(offset: float) -> float:
    """Largest angle, deg, between the follower and the normal of the path that the roller centre describes on the cam. The cam turns
    counterclockwise. The follower moves along x at y = -offset, the side on which an offset reduces the angle of the rise, as in the
    formula of the package. The normal follows from differences of points of the path."""
    base = cam.get_base_circle("cycloidal", "roller", ROLLER, offset, LIMIT)["Rb"]
    center = cam.cycloidal.S + np.sqrt((base + ROLLER) ** 2 - offset**2) - 1j * offset
    turned = np.exp(-1j * cam.thetas)
    tangent = np.gradient(center * turned, cam.thetas, edge_order=2) / turned  # in the directions of the frame
    normal = 1j * tangent
    return float(np.degrees(np.max(np.abs(np.arctan(normal.imag / normal.real)))))


plain, shifted = largest_angle(0.0), largest_angle(0.01)
print(f"mechanism {version('mechanism')}: limit {LIMIT} deg; pressure angle {plain:.2f} deg, with an offset of 10 mm {shifted:.2f} deg")
assert abs(plain - LIMIT) < 0.05, "without an offset, the pressure angle is no longer the limit"
assert shifted > LIMIT + 0.5, "with an offset, the pressure angle no longer exceeds the limit"
PY
