#!/usr/bin/env bash
# urdf2any reads the `mimic` of a URDF joint, warns that it cannot write this to USD, and omits it in MJCF without a warning. In
# the MJCF, the joint that should follow is an independent hinge, and MuJoCo's model has one freedom more. Damping and friction are
# converted. A massless root link called `world`, which ROS uses for the fixed world, becomes a massless body on a free joint:
# MuJoCo refuses this body.
# Seen: urdf2any 0.3.0 with mujoco 4.0.0: 2 freedoms (1 + the mimic) without an equality; with `world`: "mass and inertia of moving
# bodies must be larger than mjMINVAL".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "urdf2any==0.3.0" "mujoco==4.0.0" "usd-core==26.11" "trimesh==5.2.0"
cd "$folder"
cat > arm.urdf <<'XML'
<robot name="arm">
 <link name="world"/>
 <link name="a"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="b"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="j" type="continuous"><parent link="world"/><child link="a"/><axis xyz="0 1 0"/><dynamics damping="0.3" friction="0.7"/></joint>
 <joint name="k" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 -1"/><axis xyz="0 1 0"/>
  <mimic joint="j" multiplier="2" offset="0.1"/></joint>
</robot>
XML
"$folder/venv/bin/urdf2any" arm.urdf -o floating.xml > floating.txt 2>&1
"$folder/venv/bin/urdf2any" arm.urdf -o fixed.xml --fix-base --no-actuators > fixed.txt 2>&1
"$folder/venv/bin/urdf2any" arm.urdf -o fixed.usda --fix-base > usd.txt 2>&1
"$folder/venv/bin/python" - <<'PY'
from importlib.metadata import version
from pathlib import Path

import mujoco

try:
    refused = f"{mujoco.MjModel.from_xml_path('floating.xml').nv} freedoms"
except ValueError as error:
    refused = str(error).splitlines()[0]
model = mujoco.MjModel.from_xml_path("fixed.xml")
words = {name: "mimic" in Path(name).read_text().replace(str(Path.cwd()), "") for name in ("fixed.txt", "usd.txt")}
print(f"urdf2any {version('urdf2any')}: {model.nv} freedoms, {model.neq} equalities, damping {model.dof_damping}, "
      f"friction {model.dof_frictionloss}; mimic named {words}; root called world: {refused}")
assert model.nv == 2 and model.neq == 0, "the mimic arrives now"
assert words == {"fixed.txt": False, "usd.txt": True}, "the words about the mimic have changed"
assert "mjMINVAL" in refused, "MuJoCo takes the root link called world now"
PY
