"""The recursion in loops over bodies gives the results of the unrolled recursion, with any friction, drives and loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.shared_libraries import runtime
from trunnion.kernel.units import stepping_unit
from trunnion.kernel.units.stepping_unit_large_trees import MIN_BODIES, loops_pay
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.system.construction.system_builder import build

BODIES, FEW = 24, 10
"""Number of bodies of a tree that runs in loops, and of a tree that has all the features and still compiles fast when unrolled."""
RUB = {
    "revolute": sm.Friction(mu=0.3, radius=0.02, half_length=0.05, law="regularized", v_eps=1e-2),
    "spherical": sm.Friction(mu=0.5, radius=0.03, law="regularized", v_eps=1e-2),
    "universal": sm.Friction(mu=0.2, radius=0.01, half_length=0.04, law="viscous", viscosity=2.0),
    "cylindrical": sm.Friction(mu=0.1, radius=0.02, half_length=0.1, law="regularized", v_eps=1e-1),
}
ROUND_OFF = 1e-11
"""Allowed difference relative to the largest value. Bodies in a row amplify rounding errors of 1e-16 by the spread of their
inertias."""


def tree(kinds: tuple[str, ...], rubbing: bool, bodies: int = BODIES) -> sm.Scene:
    """A tree with branches and joints of all kinds in turn. Every fifth joint is reversed, every third pin is on the outboard
    part."""
    link = sm.Body(box=(0.4, 0.05, 0.03), density=2000.0, center=(0.2, 0.01, 0.0), points={"end": (0.4, 0.0, 0.05)})
    joints = {}
    for i in range(bodies):
        kind = kinds[i % len(kinds)]
        parent = f"b{i - 3 if i % 4 == 3 else i - 1}.end" if i else "ground"
        sides = (f"b{i}", parent) if i % 5 == 4 else (parent, f"b{i}")
        joints[f"j{i}"] = sm.Joint(
            kind,
            *sides,
            axis=None if kind == "spherical" else "z",
            pin="outboard" if i % 3 == 2 and kind != "universal" else "inboard",
            friction=RUB[kind] if rubbing and i % 4 == 2 else None,
            damping=0.05 if kind == "revolute" else None,
            effort=0.2 if kind == "revolute" and i % 2 else None,
        )
    push = sm.Force("force", on="b3.end", force=(1.0, -2.0, 0.5))
    return sm.Scene({f"b{i}": link for i in range(bodies)}, joints, gravity=(1.0, -9.0, 3.0), forces={"push": push})


def derivative(scene: sm.Scene) -> tuple[np.ndarray, np.ndarray]:
    """(ẏ, multipliers) of the scene at a random state."""
    model, rng = Model(scene, ("b0.position[1]",)), np.random.default_rng(7)
    block = model.block
    block.configure(bl.Settings())
    assert block.assemble() == 1
    nq = block.kernel.sizes["nq"]
    block.y[:nq] += rng.normal(0.0, 0.3, nq)
    block.y[nq : block.ny] += rng.normal(0.0, 1.0, block.ny - nq)
    assert model.begin(bl.Settings(), 0.0, 1.0, 1.0, np.zeros(block.width)) == bl.OK
    return block.evaluate()


CASES = [(("revolute",), False), (("revolute", "spherical"), True), (("universal", "revolute"), True), (("cylindrical",), True)]


def compiled(monkeypatch: pytest.MonkeyPatch, folder: Path, looped: bool) -> None:
    """From here on all kernels are compiled in loops, or all unrolled, in caches of their own, because a kernel's key does not
    depend on its C text. Both caches share the compiler's files, and the runtime is loaded before."""
    runtime()
    shared = c_compiler.shared_cache(library_cache.cache_folder())
    monkeypatch.setattr(stepping_unit, "loops_pay", lambda system, quadratures: looped)
    home = folder / str(looped)
    home.mkdir()
    (home / shared.name).symlink_to(shared)
    monkeypatch.setenv("TRUNNION_CACHE", str(home))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("kinds", "rubbing"), CASES, ids=["+".join(k) + " rubbing" * r for k, r in CASES])
def test_looped_and_unrolled_kernels_agree(
    kinds: tuple[str, ...], rubbing: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert loops_pay(build(tree(kinds, rubbing)).system, False)
    scene = tree(kinds, rubbing, FEW)
    compiled(monkeypatch, tmp_path, looped=True)
    looped, eta = derivative(scene)
    compiled(monkeypatch, tmp_path, looped=False)
    unrolled, same = derivative(scene)
    assert (eta.size > 0) == rubbing
    assert np.abs(looped - unrolled).max() <= ROUND_OFF * np.abs(unrolled).max()
    if rubbing:
        assert np.abs(eta).max() > 0.0
        assert np.abs(eta - same).max() <= ROUND_OFF * np.abs(same).max()


def test_a_run_in_loops_is_the_run_unrolled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from trunnion.simulation.run import simulate

    scene, wanted = tree(("revolute",), True, MIN_BODIES), [f"b{MIN_BODIES - 1}.position*", "j2.q[1]"]
    assert loops_pay(build(scene).system, False)
    looped = simulate(scene, until=0.2, every=0.02, rtol=1e-9, outputs=wanted)
    compiled(monkeypatch, tmp_path, looped=False)
    unrolled = simulate(scene, until=0.2, every=0.02, rtol=1e-9, outputs=wanted)
    assert looped.outcome.ok
    assert np.abs(looped.data - unrolled.data).max() <= 1e-7  # a hundred times rtol: steps may be chosen differently
