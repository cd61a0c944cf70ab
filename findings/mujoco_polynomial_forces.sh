#!/usr/bin/env bash
# MuJoCo 4.0.0 takes polynomials for `stiffness` and `damping` of a joint, and treats their second coefficients differently: the
# damping d1 d2 d3 gives -(d1 v + d2 |v| v + d3 v^3), which opposes the motion in both directions equally. The stiffness k1 k2 k3
# gives -(k1 x + k2 x^2 + k3 x^3). So k2 > 0 weakens the spring on one side, and beyond x = -k1/k2 the spring pushes away from rest.
# The `damping` of an actuator with gear g is multiplied by g^2 in all its terms, although the rate of its shaft is g v and power
# balance would give g^2, |g|^3 and g^4. The quadratic drag of a motor behind a gear, as given in a catalogue, is therefore too
# small by the factor |g|.
# Seen: 4.0.0 on Linux x86-64: damping 2.1 and -2.1 N m at 3 and -3 rad/s; stiffness 1.75 and -0.25 N m at 0.5 and -0.5 rad.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "mujoco==4.0.0"
"$folder/venv/bin/python" - <<'PY'
import mujoco


def torque(joint: str, motor: str = "", x: float = 0.0, v: float = 0.0) -> float:
    """Passive torque against the motion of a hinge, N m."""
    actuator = f'<actuator><motor joint="j" {motor}/></actuator>' if motor else ""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian"/><worldbody><body><joint name="j" {joint}/><geom size="0.1"/></body></worldbody>{actuator}</mujoco>'
    )
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = x, v
    mujoco.mj_forward(model, data)
    return -float(data.qfrc_passive[0])


damped = [torque('damping="0.1 0.2"', v=v) for v in (3.0, -3.0)]
sprung = [torque('stiffness="2 3"', x=x) for x in (0.5, -0.5, -1.0)]
geared = [torque("", f'gear="{g}" damping="0.1 0.2 0.4"', v=3.0) for g in (1, 2, -2)]
print(f"MuJoCo {mujoco.__version__}: damping {damped}, stiffness {sprung}, actuator with gear 1, 2, -2: {geared}")
close = lambda got, want: all(abs(a - b) < 1e-12 * max(1.0, abs(b)) for a, b in zip(got, want, strict=True))
assert close(damped, [2.1, -2.1]), "quadratic damping is no longer odd"
assert close(sprung, [1.75, -0.25, 1.0]), "quadratic stiffness is no longer even"
assert close(geared, [12.9, 4 * 12.9, 4 * 12.9]), "all terms of an actuator's damping are no longer multiplied by the square of its gear"
PY
