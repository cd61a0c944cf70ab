#!/usr/bin/env bash
# truerig converts robots between URDF, MJCF and USD and prints a "fidelity report" of what it changed. Its URDF reader reads the
# friction of joints. Its MJCF writer omits this friction, and the report does not list it. A joint with damping 0.3 and friction
# 0.7 gets the damping, but no `frictionloss`; the report has no error and no warning. A conversion from MJCF to URDF also loses the
# damping, together with armature and spring, which URDF lacks. The report's verdict is PASS, without a note.
# Seen: truerig 0.1.1 with mujoco 4.0.0.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "truerig==0.1.1" "mujoco==4.0.0" "yourdfpy==0.0.60" "trimesh==5.2.0"
cd "$folder"
cat > arm.urdf <<'XML'
<robot name="arm">
 <link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="a"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="j" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="10" velocity="5"/><dynamics damping="0.3" friction="0.7"/></joint>
</robot>
XML
cat > arm.xml <<'XML'
<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="base"><geom size="0.1"/><body name="a">
 <joint name="j" axis="0 1 0" range="-3 3" damping="0.3" frictionloss="0.7" armature="0.05" stiffness="2"/>
 <inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/></body></body></worldbody></mujoco>
XML
"$folder/venv/bin/truerig" convert arm.urdf to.xml > to_mjcf.txt
"$folder/venv/bin/truerig" convert arm.xml to.urdf > to_urdf.txt || true
"$folder/venv/bin/python" - <<'PY'
from importlib.metadata import version
from pathlib import Path

texts = {name: Path(name).read_text() for name in ("to.xml", "to_mjcf.txt", "to.urdf", "to_urdf.txt")}
joint = next(line.strip() for line in texts["to.xml"].splitlines() if "<joint" in line)
dynamics = [line.strip() for line in texts["to.urdf"].splitlines() if "dynamics" in line]
verdicts = [line.strip() for name in ("to_mjcf.txt", "to_urdf.txt") for line in texts[name].splitlines() if "verdict" in line]
print(f"truerig {version('truerig')}: {joint}; dynamics in the URDF: {dynamics}; {verdicts}")
told = "\n".join(line for name in ("to_mjcf.txt", "to_urdf.txt") for line in texts[name].splitlines() if "contact" not in line)
assert 'damping="0.3"' in joint and "frictionloss" not in joint, "the friction of the joint arrives now"
assert all("errors=0  warnings=0" in verdict for verdict in verdicts), "the reports have errors or warnings now"
assert not any(word in told for word in ("friction", "damping", "armature", "stiffness")), "the report names what is lost now"
PY
