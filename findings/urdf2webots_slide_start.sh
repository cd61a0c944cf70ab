#!/usr/bin/env bash
# urdf2webots starts a joint in the middle of its limits if these exclude 0, because Webots requires a position within the limits.
# For a prismatic joint, it writes this position, and moves the child link by it. It adds all three components of the movement to
# the x coordinate. So the child of a vertical slide starts beside its place: it is shifted along x instead of z, although the
# position in the same file is right. The slide keeps this shift. If both limits are negative, neither position nor child moves.
# Seen: urdf2webots 2025.0.0, axis z, limits 0.1 and 0.3 m: position 0.2; translation of the child 0.2 0 0, right is 0 0 0.2.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q --no-compile "urdf2webots==2025.0.0" "numpy==2.2.6"
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import re
from importlib.metadata import version

from urdf2webots.importer import convertUrdfContent

LINK = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'


def written(axis: str, lower: float, upper: float) -> tuple[list[float], list[float]]:
    """Start position of a slide, and translation of its child, both [] if they are not written (0)."""
    joint = (f'<joint name="s" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="{axis}"/>'
             f'<limit lower="{lower}" upper="{upper}" effort="10" velocity="1"/></joint>')
    text = convertUrdfContent(f'<robot name="r">{LINK.format("a")}{LINK.format("b")}{joint}</robot>', robotName="r")
    slide = text[text.index("SliderJoint"):]
    found = (re.search(r"\bposition ([-\d.e]+)", slide), re.search(r"translation ([-\d.e]+ [-\d.e]+ [-\d.e]+)", slide))
    position, place = ([float(x) for x in f.group(1).split()] if f else [] for f in found)
    return position, place


cases = {axis: written(axis, 0.1, 0.3) for axis in ("1 0 0", "0 1 0", "0 0 1")}
print(f"urdf2webots {version('urdf2webots')}: position and translation of the child, by axis: {cases}")
assert all(position == [0.2] for position, _ in cases.values()), "the slide no longer starts in the middle of its limits"
assert all(place == [0.2, 0, 0] for _, place in cases.values()), "the child is no longer moved along x for each axis"
negative = written("0 0 1", -0.3, -0.1)
print(f"limits -0.3 and -0.1 m: {negative}")
assert negative[0] == [], "a slide with negative limits now has a position"
PY
