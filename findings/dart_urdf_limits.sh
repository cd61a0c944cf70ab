#!/usr/bin/env bash
# DART reads and reports the joint limits of a URDF, but does not enforce them. A program must enable the enforcement for each
# joint. A pendulum with limits of -0.1 and 0.1 rad passes both limits and swings through half a turn, without a warning.
# After `setLimitEnforcement(True)` on the joint, the pendulum stays within 0.1 rad.
# Seen: dartpy 6.20.0 and 6.20.3: limits -0.1, 0.1 read; largest angle within 1 s: 3.1416 rad; with enforcement 0.1000 rad.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --no-compile "dartpy==6.20.0" "numpy==2.2.6"
cd "$folder"
cat > arm.urdf <<'XML'
<robot name="arm">
 <link name="world"/>
 <link name="a"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="j" type="revolute"><parent link="world"/><child link="a"/><axis xyz="0 1 0"/>
  <limit lower="-0.1" upper="0.1" effort="10" velocity="50"/></joint>
</robot>
XML
"$folder/venv/bin/python" - <<'PY'
from importlib.metadata import version
from pathlib import Path

import dartpy as dart


def largest(kept: bool) -> float:
    """Largest angle, rad, within 1 s. Gravity is along x, at a right angle to the arm."""
    skeleton = dart.utils.DartLoader().parseSkeleton(str(Path("arm.urdf").resolve()))
    joint = skeleton.getJoint("j")
    assert (joint.getPositionLowerLimit(0), joint.getPositionUpperLimit(0)) == (-0.1, 0.1), "the limits are no longer read"
    if kept:
        joint.setLimitEnforcement(True)
    world = dart.simulation.World()
    world.setGravity([9.81, 0, 0])
    world.addSkeleton(skeleton)
    most = 0.0
    for _ in range(1000):
        world.step()
        most = max(most, abs(joint.getPosition(0)))
    return most


read, kept = largest(False), largest(True)
print(f"dartpy {version('dartpy')}: limits -0.1, 0.1 rad; largest angle {read:.4f} rad, with enforcement {kept:.4f} rad")
assert read > 3.0, "the limits of the file are kept now"
assert kept < 0.101, "enforced limits are no longer kept"
PY
