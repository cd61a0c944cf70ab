#!/usr/bin/env bash
# mjcf-urdf-simple-converter writes every hinge of an MJCF as a `revolute` joint with the limits of `jnt_range`. For a hinge without
# range, MuJoCo stores 0 0 in `jnt_range`, so a free hinge becomes a joint locked at 0: lower = upper = 0, not `continuous`. Each
# joint also adds a link of 1 g, slides become fixed joints, and damping and friction are omitted. Readers that enforce limits then
# hold the pendulum upright without a warning.
# Seen: mjcf-urdf-simple-converter 0.7.3 with mujoco 4.0.0: lower 0, upper 0, total mass 1.001 kg instead of 1 kg.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "mjcf-urdf-simple-converter==0.7.3" "mujoco==4.0.0" "scipy==1.15.3" "numpy-stl==3.2.0"
cd "$folder"
cat > arm.xml <<'XML'
<mujoco><compiler angle="radian"/><worldbody><body name="a"><joint name="j" axis="0 1 0" damping="0.3"/>
 <inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>
XML
"$folder/venv/bin/python" - <<'PY'
from importlib.metadata import version
from xml.etree import ElementTree

from mjcf_urdf_simple_converter import convert

convert("arm.xml", "arm.urdf")
robot = ElementTree.parse("arm.urdf").getroot()
joint = next(j for j in robot.iter("joint") if j.get("name") == "j")
limit = joint.find("limit")
mass = sum(float(m.get("value")) for m in robot.iter("mass"))
print(f"mjcf-urdf-simple-converter {version('mjcf-urdf-simple-converter')}: {joint.get('type')}, {limit.attrib}, "
      f"dynamics {joint.find('dynamics')}, {mass:g} kg")
assert joint.get("type") == "revolute" and float(limit.get("lower")) == float(limit.get("upper")) == 0.0, "a free hinge stays free now"
assert abs(mass - 1.001) < 1e-12, "no link of 1 g is added any more"
assert joint.find("dynamics") is None, "the damping arrives now"
PY
