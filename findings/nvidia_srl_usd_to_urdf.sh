#!/usr/bin/env bash
# nvidia-srl-usd-to-urdf writes a URDF from OpenUSD physics. Its output contradicts the schema of OpenUSD physics in four cases. A
# mass without `physics:centerOfMass` has the schema's default value -inf, which means "computed by the reader": the URDF gets
# <origin xyz="-inf -inf -inf"/>. `metersPerUnit` is not used: a guide of 0.2 m in a stage of centimetres becomes a guide of 20 m. A
# spherical joint, which URDF lacks, becomes a fixed joint, although the code has messages for joints that it skips. A guide without
# a drive gets effort="0" velocity="0", which in URDF is an actuator without force and speed. A hinge without limits loses its
# maxForce. In each case the command's exit code is 0, and it prints no warning.
# Seen: nvidia-srl-usd-to-urdf 1.0.3 with usd-core 25.11.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "nvidia-srl-usd-to-urdf==1.0.3" "nvidia-srl-usd==2.0.0" "nvidia-srl-base==1.6.0" "nvidia-srl-math==1.1.0" \
  "usd-core==25.11" "numpy==1.26.4"
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import contextlib
import io
import re
import warnings
from importlib.metadata import version
from pathlib import Path

from nvidia.srl.from_usd.to_urdf import UsdToUrdf

TEXT = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = %s
    upAxis = "Z"
)
def Xform "World"
{
    def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 1
        float3 physics:diagonalInertia = (0.01, 0.01, 0.01)
        point3f physics:centerOfMass = (0, 0, 0)
    }
    def Xform "arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 1
        float3 physics:diagonalInertia = (0.01, 0.01, 0.01)
    }
    def Physics%sJoint "j" (%s)
    {
        rel physics:body0 = </World/base>
        rel physics:body1 = </World/arm>
        %s
    }
}
"""


def urdf(name: str, metres: float, kind: str, lines: str = "", schema: str = "") -> tuple[str, list[str]]:
    """Convert a file. Returns the URDF and the warnings."""
    Path(f"{name}.usda").write_text(TEXT % (metres, kind, schema, lines))
    with warnings.catch_warnings(record=True) as told, contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("always")
        UsdToUrdf.init_from_file(f"{name}.usda").save_to_file(f"{name}.urdf", quiet=True)
    return Path(f"{name}.urdf").read_text(), [str(w.message) for w in told if not issubclass(w.category, DeprecationWarning)]


guide, told = urdf("guide", 0.01, "Prismatic", "float physics:lowerLimit = 0\n        float physics:upperLimit = 20")
ball, words = urdf("ball", 1, "Spherical")
force = "float drive:angular:physics:maxForce = 7\n        float drive:angular:physics:stiffness = 1"
hinge, more = urdf("hinge", 1, "Revolute", force, 'prepend apiSchemas = ["PhysicsDriveAPI:angular"]')
limit = re.search(r"<limit .*?/>", guide)[0]
centre = re.search(r'<link name="arm">.*?<origin xyz="(.*?)"', guide, re.S)[1]
kind = re.search(r'<joint name="j" type="(.*?)"', ball)[1]
print(f"nvidia-srl-usd-to-urdf {version('nvidia-srl-usd-to-urdf')}: centre {centre}; {limit}; spherical joint: {kind}; "
      f"largest torque of the hinge kept: {'effort' in hinge}; warnings: {told + words + more}")
assert centre == "-inf -inf -inf", "a centre that is not given is computed or left out now"
assert 'upper="20."' in limit and 'effort="0."' in limit, "the units of length or the effort have changed"
assert kind == "fixed", "a spherical joint is no longer fixed"
assert "effort" not in hinge, "the largest torque of a hinge without limits arrives now"
assert not told + words + more, "there are warnings now"
PY
