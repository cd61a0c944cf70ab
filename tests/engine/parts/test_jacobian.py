"""The Jacobian of a kernel made of parts equals the compiled Jacobian up to the last digits. No code is compiled for the kernel
made of parts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.engine.checks.right_hand_side import block_after, block_at
from tests.engine.kernel.test_jacobian import case_of, check
from tests.engine.parts.test_compiled_kernel_equivalence import ROUND_OFF, State, called, loop, tree
from tests.engine.stick_slip.test_active_set_many_pairs import links
from trunnion.kernel.compilation import c_compiler
from trunnion.kernel.shared_libraries import kernel
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.runtime.abi.kernel_records import JACOBIAN, KERNEL
from trunnion.scene import load_scene, scene_from_dict
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import build

TREES = (1, 2, 8, 11)
"""Seeds of ``test_compiled_kernel_equivalence``: drives, tables, loads, springs between bodies, stops, every law, joints traversed
in both directions."""
LOOPS = (1, 4, 8)
MODELS = ("andrews", "bricard")


def columns(table: Any, sizes: Any, s: State) -> np.ndarray:
    """All numbers that a Jacobian unit writes: the derivative of [F; R; scaled reactions; the changes of these by friction] with
    respect to [y, t, z]."""
    ny, nz = sizes.nq + sizes.nv + sizes.nb, sizes.active + sizes.neta
    J, c, w = np.full((ny + 1 + nz, ny + nz + sizes.nkappa + sizes.nmore), np.nan), np.zeros(table.nc + 8), np.zeros(table.nw + 8)
    called(table, "prepare", s.p, c)
    if table.eval:
        called(table, "eval", s.x, s.y, c, s.z, w, J)
        return J.T
    called(table, "point", s.x, s.y, c, s.z, w)
    for i, seed in enumerate(np.eye(len(J), len(J) + 1)):
        called(table, "along", s.x, s.y, c, s.z, w, seed, J[i])
    return J.T


def agree(scene: Scene, redundant: bool = False) -> None:
    """Check that a scene's two Jacobian units write the same numbers."""
    built = build(scene)
    units = [make(built.system, len(built.parameters.values), [], False, redundant) for make in (kernel, parts_kernel)]
    compiled, parts = (JACOBIAN.ctype.from_address(k.jacobian()) for k in units)
    sizes = KERNEL.ctype.from_address(units[1].address("kernel"))
    for number in range(3):
        state = State(built, sizes, number)
        expected, found = columns(compiled, sizes, state), columns(parts, sizes, state)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUND_OFF * np.abs(expected).max())


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", TREES)
def test_the_jacobian_made_of_parts_is_the_compiled_one(seed: int) -> None:
    agree(tree(seed))


@pytest.mark.slow
@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", LOOPS)
def test_derivatives_of_loops_with_and_without_the_choice_of_open_reactions_agree(seed: int) -> None:
    agree(loop(seed), redundant=bool(build(loop(seed)).system.frictional))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", ["ball and cross on a loop", "table", "driven", "open reactions"])
def test_the_jacobian_of_parts_is_the_derivative_of_the_right_hand_side(which: str) -> None:
    check(block_at(case_of(which), kernel="parts"))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", MODELS)
def test_rows_that_are_empty_by_structure_have_no_columns(name: str) -> None:
    agree(load_scene(name))


def test_nothing_is_compiled_for_an_unseen_structure_that_is_stiff(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*given: object) -> None:
        raise AssertionError("a compiler was called")

    how = {"until": 0.1, "kernel": "parts", "method": "rosenbrock"}
    assert simulate(links(1, 0, "revolute", apart=False), **how).outcome.ok
    monkeypatch.setattr(c_compiler, "build_library", none)
    for count in (2, 7):
        run = simulate(links(count, 0, "revolute", apart=False), **how)
        assert run.outcome.ok
        assert run.stats.jacobians > 0


def test_a_joint_on_a_loop_that_forbids_nothing_has_no_rows_to_differentiate() -> None:
    """Two pendulums with a bushing between them have no products of rows. Therefore they have no products of rows with
    directions."""
    bodies = {f"b{k}": {"box": [0.4, 0.05, 0.05], "mass": 1.0, "points": {"end": [-0.2, 0, 0], "tip": [0.2, 0, 0]}} for k in (1, 2)}
    hinges = {f"h{k}": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": f"b{k}.end"} for k in (1, 2)}
    bushing = {"type": "free", "inboard": "b1.tip", "outboard": "b2.tip", "damping": [0.3] * 6, "cut": True}
    scene = scene_from_dict({"schema": 1, "bodies": bodies, "joints": {**hinges, "bushing": bushing}})
    assert [j.kind.rows for j in build(scene).system.joints if j.cut] == [0]
    check(block_after(scene, 0.2, kernel="parts"))
