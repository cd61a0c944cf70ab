#!/usr/bin/env bash
# In opentorsion, a shaft is given by its dimensions or by stiffness and inertia: `Shaft(nl, nr, k=..., I=...)`. The documentation
# calls `I` "Moment of inertia of the shaft [kgm^2]". The mass matrix is I [[2, 1], [1, 2]], without the divisor 6 of the consistent
# mass matrix. So a shaft has six times the inertia that was given. A shaft that is given by its dimensions has the right inertia.
# Its first frequency with free ends is 2 sqrt(3 k / I). The shaft given by k and I has this frequency divided by sqrt(6).
# Seen: opentorsion 0.3.2, shaft of 1 m and 50 mm: inertia 1.000 and 6.000 times rho J L.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --no-compile "opentorsion==0.3.2" "numpy==2.2.6" "scipy==1.15.3"
"$folder/venv/bin/python" - <<'PY'
import math
from importlib.metadata import version

import numpy as np
import opentorsion as ot

L, D, G, rho = 1.0, 0.05, 80e9, 8000.0
J = math.pi * D**4 / 32
k, inertia = G * J / L, rho * J * L


def measured(shaft: ot.Shaft) -> tuple[float, float]:
    """Inertia of the shaft as a rigid body over rho J L, and its first frequency with free ends over 2 sqrt(3 k / I)."""
    whole = ot.Assembly([shaft])
    rigid = np.ones(2) @ whole.M @ np.ones(2)
    frequencies = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(whole.M, whole.K))))
    return rigid / inertia, max(frequencies) / (2 * math.sqrt(3 * k / inertia))


by_size = measured(ot.Shaft(0, 1, L=L * 1e3, odl=D * 1e3, G=G, rho=rho))
by_numbers = measured(ot.Shaft(0, 1, k=k, I=inertia))
print(f"opentorsion {version('opentorsion')}, inertia and frequency over the right ones: "
      f"by dimensions {by_size[0]:.6f}, {by_size[1]:.6f}; by k and I {by_numbers[0]:.6f}, {by_numbers[1]:.6f}")
assert np.allclose(by_size, 1, atol=1e-9), "a shaft given by its dimensions no longer has the right inertia"
assert abs(by_numbers[0] - 6) < 1e-9, "a shaft given by k and I no longer has six times its inertia"
assert abs(by_numbers[1] - 1 / math.sqrt(6)) < 1e-9, "its frequency no longer follows from six times the inertia"
PY
