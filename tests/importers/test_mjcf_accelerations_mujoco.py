"""MJCF compared with MuJoCo, with constraints and contacts off: the same accelerations at random states. For loops, the test solves
the equations of motion with the rows of MuJoCo's constraints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import robot_collections
from tests.importers.mujoco_comparison import accelerations, compared, coordinates, evaluable, quiet
from tests.importers.test_mjcf import FOUR_BAR
from trunnion.importers.mjcf.scene_builder import linkage_of_mjcf

EXACT = 1e-9
"""Both programs solve to about 1e-14 times the condition; MuJoCo's principal axes of composed bodies are precise to 1e-8 of a
moment."""
KINDS = ("hinge", "slide", "ball", "hinge hinge", "slide slide hinge", "hinge hinge hinge", "slide ball", "")


def random_model(seed: int) -> str:
    """A tree with joints of all kinds. A body may have several joints, and all forces that can act along a joint act."""
    rng = np.random.default_rng(seed)
    three = lambda s=1.0: " ".join(f"{x:.4f}" for x in s * rng.normal(size=3))  # noqa: E731

    def joint(kind: str) -> str:
        springs = f'stiffness="{rng.uniform(0, 5):.3f}" springref="{rng.normal():.3f}"' if kind in ("hinge", "slide") else ""
        ref = f'ref="{rng.normal():.3f}"' if kind in ("hinge", "slide") else ""
        axis = "" if kind == "ball" else f'axis="{three()}"'
        acting = f'damping="{rng.uniform():.3f}" armature="{rng.uniform():.3f}" frictionloss="0.1"'
        return f'<joint type="{kind}" pos="{three(0.1)}" {axis} {springs} {ref} {acting}/>'

    def geom() -> str:
        kind = rng.choice(["sphere", "capsule", "cylinder", "box", "ellipsoid"])
        size = " ".join(f"{x:.3f}" for x in rng.uniform(0.05, 0.2, {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)))
        return f'<geom type="{kind}" size="{size}" pos="{three(0.1)}" euler="{three(40)}"/>'

    def body(depth: int) -> str:
        kinds = str(rng.choice(KINDS)).split()
        inside = "".join(map(joint, kinds)) + "".join(geom() for _ in range(rng.integers(1, 3)))
        carried = "".join(body(depth + 1) for _ in range(rng.integers(1, 3))) if depth < 3 else ""
        return f'<body pos="{three(0.3)}" euler="{three(50)}">{inside}{carried}</body>'

    free = f'<body pos="0 0 1" quat="{three()} 0.5"><freejoint/>{geom()}{body(1)}</body>'
    return f'<mujoco><option gravity="{three(5)}"/><worldbody>{body(0)}{free}</worldbody></mujoco>'


@pytest.mark.parametrize("seed", range(6))
def test_trees_move_as_in_mujoco(seed: int, tmp_path: Path, needs: Callable[[str], None]) -> None:
    needs("mujoco")
    file = tmp_path / "tree.xml"
    file.write_text(random_model(seed))
    found = compared(file)
    assert found.gap_with <= EXACT
    assert found.inertia <= 1e-7


CLOSINGS = {
    "connect": '<connect body1="coupler" body2="rocker" anchor="0.5 0 0.1"/>',
    "weld": '<weld body1="coupler" body2="rocker"/>',
    "joint": '<joint joint1="b" joint2="a" polycoef="0 -0.6 0 0 0"/>',
    "joints on each side": '<joint joint1="c" joint2="b" polycoef="0 1.4 0 0 0"/>',
    "connect to the world": '<connect body1="coupler" anchor="0.2 0 0.1"/>',
}


@pytest.mark.parametrize("how", CLOSINGS)
def test_loops_move_as_the_rows_of_mujocos_constraints_say(how: str, tmp_path: Path, needs: Callable[[str], None]) -> None:
    """M q̈ − Jᵀ λ = τ, J q̈ + J̇ q̇ = 0 by the least norm, from MuJoCo's M, τ and J; J̇ q̇ by differences along the motion."""
    needs("mujoco")
    import mujoco

    file = tmp_path / "loop.xml"
    file.write_text(f"<mujoco>{FOUR_BAR.format(CLOSINGS[how])}</mujoco>")
    linkage, _, bodies = linkage_of_mjcf(file)
    m = quiet(mujoco.MjModel.from_xml_path(str(file)), constraints=True)
    d, data = mujoco.MjData(m), {}

    def rows(q: np.ndarray) -> np.ndarray:
        d.qpos[:] = q
        mujoco.mj_forward(m, d)
        J = np.zeros((d.nefc, m.nv))
        J[:] = d.efc_J.reshape(d.nefc, m.nv) if not mujoco.mj_isSparse(m) else 0.0
        return J

    m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    J = rows(m.qpos0)
    _, sizes, V = np.linalg.svd(J)
    free = V[(sizes > 1e-9 * sizes[0]).sum() :]
    v = free.T @ np.ones(len(free))
    d.qvel[:] = v
    mujoco.mj_forward(m, d)
    M, tau = np.zeros((m.nv, m.nv)), d.qfrc_passive - d.qfrc_bias
    mujoco.mj_fullM(m, d, M)
    ahead, behind = (rows(m.qpos0 + h * v) for h in (1e-5, -1e-5))
    bias = (ahead - behind) @ v / 2e-5
    system = np.block([[M, -J.T], [J, np.zeros((len(J), len(J)))]])
    expected = np.linalg.lstsq(system, np.r_[tau, -bias], rcond=1e-12)[0][: m.nv]
    data = coordinates(m, bodies.freedoms, m.qpos0, v, expected)
    mine = accelerations(evaluable(linkage.scene()), data[0], data[1])
    for name, want in data[2].items():
        assert mine[name] == pytest.approx(want, rel=1e-8, abs=1e-8)  # differences with steps of 1e-5 are precise to 1e-9


@pytest.mark.slow
def test_every_robot_of_the_installed_packages_is_taken_over_exactly_or_refused_with_reason(needs: Callable[[str], None]) -> None:
    """Robots of dm_control and other packages are compared with MuJoCo and Pinocchio. The same script writes the page of tested
    models."""
    needs("mujoco")
    needs("pinocchio")
    needs("dm_control")
    found = [(name, *robot_collections.result(file)) for _, name, file in robot_collections.files()]
    assert [f for f in found if f[1] == "differ" or (f[1] == "refused" and not f[2])] == []
    assert sum(kind == "same" for _, kind, *_ in found) >= 30
