#!/usr/bin/env bash
# The package tribology has one argument `e_eff` for its functions of Hertzian contact, and a function `eeff` that computes it: E' =
# 2 / ((1 - n1^2)/E1 + (1 - n2^2)/E2). `ahertz` (contact area) and `phertz` (pressure) take this E'. `dhertz` (approach of the
# bodies) takes half of it, E* = 1 / ((1 - n1^2)/E1 + (1 - n2^2)/E2), but its documentation does not state this. With the modulus
# that the package computes, the approach is 2^(-2/3) = 63 % of Hertz's F-d relation, while pressure and area are right to the last
# digit.
# Seen: tribology 0.5.16, steel ball of 10 mm radius on a steel plane, 100 N: area and pressure as Hertz, approach 2.194 um, Hertz
# 3.483 um.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "numpy==2.2.6" "numexpr==2.14.2" "scipy==1.15.3"
"$folder/venv/bin/pip" install -q --no-deps "tribology==0.5.16" # --no-deps: the package requires versions of numpy and OpenCV that do not support this Python
"$folder/venv/bin/python" - <<'PY'
import importlib
import importlib.metadata
import importlib.util
import math
import sys
import types

where = importlib.util.find_spec("tribology").submodule_search_locations
sys.modules["tribology"] = package = types.ModuleType("tribology")  # an empty package, so that its __init__, which imports OpenCV, does not run
package.__path__ = list(where)
hertz = importlib.import_module("tribology.hertz")

E, nu, R, F = 210e9, 0.3, 0.01, 100.0
E_star = E / (2 * (1 - nu**2))
a = (3 * F * R / (4 * E_star)) ** (1 / 3)
modulus = hertz.eeff(E, nu, E, nu)
area = hertz.ahertz(*hertz.reff(R, R, 0, 0), modulus, F)[2] / (math.pi * a * a)
pressure = hertz.phertz(*hertz.reff(R, R, 0, 0), modulus, F, "max") / (1.5 * F / (math.pi * a * a))
approach = hertz.dhertz(modulus, R, R, math.inf, math.inf, F) / (a * a / R)
right = hertz.dhertz(modulus / 2, R, R, math.inf, math.inf, F) / (a * a / R)
print(f"tribology {importlib.metadata.version('tribology')}, over Hertz: area {area:.6f}, pressure {pressure:.6f}, "
      f"approach {approach:.6f}; with half the modulus {right:.6f}")
assert abs(area - 1) < 1e-9, "the area is no longer Hertz's"
assert abs(pressure - 1) < 1e-9, "the pressure is no longer Hertz's"
assert abs(approach - 2 ** (-2 / 3)) < 1e-6, "the approach no longer takes another modulus"
assert abs(right - 1) < 1e-6, "the approach is no longer Hertz's with E*"
PY
