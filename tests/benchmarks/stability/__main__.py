"""The stability gallery as a table: what happens here on both sides of each threshold, and, where it can be measured in
this script,
what happens elsewhere: SciPy on the regularised law, MuJoCo when it is installed.

``python -m tests.benchmarks.stability`` prints the table; with ``--write`` it also writes the scenes and the README of
``models/stability``."""

from __future__ import annotations

import importlib.util
import math
import sys

from scipy.integrate import solve_ivp

from engine.scene import models_dir
from engine.scene.dump import scene_to_yaml
from tests.benchmarks.pendulum import MU, OMEGA_EPS, G, L, M, R, alpha
from tests.stability.row import EDGE, Edge
from tests.stability.rows import ROWS

HEAD = """# Stability gallery

Nineteen places where methods fail, each with a scene to run and a test
([tests/stability](../../tests/stability/test_gallery.py)) that
looks at it on both sides of its threshold (one part in a million), with the world turned at random, and in other units of
length, mass
and time. `trunnion simulate models/stability/01_zero_speed.yaml` runs one; the files are just beyond the threshold. The table is
written by `python -m tests.benchmarks.stability --write`; what is in the last column in *italics* was measured by it.

| | where methods fail | scene | threshold: here below / beyond it | elsewhere |
|---|---|---|---|---|
"""


def crept(v_eps: float, method: str, until: float) -> tuple[float, int]:
    """Degrees the pendulum, put at rest at 2°, is at in the end with the regularised law, and right-hand sides it took (SciPy)."""
    edge = v_eps / R

    def rate(_t: float, y) -> list[float]:
        slow = abs(y[1]) < edge
        return [y[1], alpha(y[0], y[1] * OMEGA_EPS / edge) if slow else alpha(y[0], y[1], 1 if y[1] > 0 else -1)]

    s = solve_ivp(rate, (0.0, until), [math.radians(2.0), 0.0], method=method, rtol=1e-8, atol=1e-12)
    return math.degrees(s.y[0, -1]), int(s.nfev)


def mujoco_crept() -> str:
    """The same in MuJoCo, its constant friction loss set to the most that the ball could hold at 2°."""
    if importlib.util.find_spec("mujoco") is None:
        return ""
    import mujoco

    most = M * G * R * MU / math.hypot(1.0, MU)
    xml = (
        f'<mujoco><compiler angle="radian"/><option timestep="1e-3" gravity="0 0 -{G}"/><worldbody><body>'
        f'<joint name="h" type="hinge" axis="0 1 0" frictionloss="{most}"/>'
        f'<inertial pos="0 0 -{L}" mass="{M}" diaginertia="6.5 6.5 .13"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[0] = math.radians(2.0)
    mujoco.mj_step(model, data, nstep=10_000)
    return f"; *MuJoCo's friction loss: 2° becomes {math.degrees(data.qpos[0]):.4f}° in 10 s*"


def measured() -> dict[int, str]:
    """What was measured elsewhere, by row."""
    angle, _ = crept(1e-4, "Radau", 10.0)
    work = [crept(v, "DOP853", 0.5)[1] for v in (1e-4, 1e-5, 1e-6)]
    return {
        1: f"*regularised at 1e-4 m/s (SciPy): 2° creeps to {angle:.3f}° in 10 s*{mujoco_crept()}",
        2: "*regularised, SciPy DOP853, half a second near rest: {} evaluations at v_eps 1e-4, {} at 1e-5, {} at 1e-6*".format(
            *work
        ),
    }


def said(edge: Edge) -> str:
    """Threshold, and what is said on both sides of it."""
    return f"{edge.at}: " + " / ".join(f"**{edge.verdict(edge.scene(b))}**" for b, _ in edge.sides)


def main(write: bool) -> None:
    """Print, or write, the table."""
    known, lines, folder = measured(), [], models_dir() / "stability"
    for row in ROWS:
        file = f"{row.number:02d}_{row.name}.yaml"
        there = known.get(row.number, row.elsewhere)
        here = "<br>".join(said(e) for e in row.edges)
        lines.append(f"| {row.number} | {row.title} | [{row.name}]({file}) | {here} | {there} |")
        if write:
            folder.mkdir(exist_ok=True)
            title = f"# {row.number}. {row.title}, one part in a million beyond the threshold (where there is one).\n"
            (folder / file).write_text(title + scene_to_yaml(row.edges[0].scene(EDGE)), encoding="utf-8")
    text = HEAD + "\n".join(lines) + "\n"
    print(text)
    if write:
        (folder / "README.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main("--write" in sys.argv)
