"""The reported contraction is the spectral radius of a dense matrix that the independent reference differentiates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.reference.contact_and_friction.complement_equation_roots import Complement, NoRoot, connected_root
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.scenes.random_components import RUBBING_TYPES
from tests.reference.scenes.random_scenes import Case, random_loop, random_tree
from trunnion import simulate
from trunnion.scene.data_classes import scene as sm

RUBBING = {"friction": 1.0, "devices": 0.0, "drives": 0.0, "loads": False, "types": RUBBING_TYPES}
PROMISE = 1e-4
"""Relative to the spectral radius (theory, "Certificate")."""
STEP = 1e-6
"""Step of the differences, in units of the force without friction. Larger steps cross the kinks of the laws; smaller ones lose
digits to round-off."""
SIZES = (2, 3, 4, 6, 8, 12, 16)
LARGE = (24, 32, 48, 64)
SHAPES = ("chain", "tree", "loop")
SCENES = [(shape, SIZES[i % len(SIZES)], i) for i in range(35) for shape in SHAPES]
INSTANT = 1e-9
"""s; duration of a run of which only the start is compared."""


def chain(seed: int, bodies: int) -> Case:
    """The bodies and joints of a random tree, each on the one before."""
    case = random_tree(f"links{seed}", bodies, **RUBBING)
    joints = {}
    for i, (name, joint) in enumerate(case.scene.joints.items()):
        own, base = f"b{i + 1}", f"b{i}" if i else "ground"
        ends = {end: _moved(getattr(joint, end), own, base) for end in ("inboard", "outboard")}
        joints[name] = replace(joint, **ends)
    return replace(case, scene=replace(case.scene, joints=joints))


def _moved(end: sm.Side | str, own: str, base: str) -> sm.Side | str:
    """This end of a joint, on `base` instead of on another part than `own`."""
    if isinstance(end, sm.Side):
        return end if end.body == own else replace(end, body=base)
    part, *point = end.split(".")
    return end if part == own else ".".join([base, *point])


def build_mechanism(shape: str, bodies: int, seed: int) -> Case:
    """A random mechanism of this shape, in which every joint rubs."""
    if shape == "chain":
        return chain(seed, bodies)
    if shape == "tree":
        return random_tree(f"branches{seed}", bodies, **RUBBING)
    return random_loop(f"rings{seed}", 1 + (seed % 2 if bodies > 2 else 0), bodies, closing=RUBBING_TYPES, **RUBBING)


def dense_radius(case: Case) -> float:
    """Spectral radius of the derivative of the laws' friction by the friction, from all eigenvalues. The columns of this matrix are
    central differences."""
    equations = Equations(case.state())
    problem, y = Complement(equations), connected_root(equations)

    def at(offset: np.ndarray) -> np.ndarray:
        return problem.friction(y + offset * problem.unit, 1.0) / problem.unit

    columns = [(at(STEP * e) - at(-STEP * e)) / (2 * STEP) for e in np.eye(len(y))]
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())


def compare_radii(shape: str, bodies: int, seed: int) -> None:
    """Compare the reported contraction with the dense one. Skips a scene whose start has no root."""
    case = build_mechanism(shape, bodies, seed)
    try:
        radius = dense_radius(case)
    except NoRoot as none:
        pytest.skip(str(none))
    run = simulate(case.scene, until=INSTANT, every=INSTANT, outputs="audit.contraction", kernel="parts")
    assert run["audit.contraction"][0] == pytest.approx(radius, rel=PROMISE)


@pytest.mark.default_cases(12)
@pytest.mark.parametrize(("shape", "bodies", "seed"), SCENES)
def test_the_contraction_is_the_spectral_radius_of_a_dense_matrix(shape: str, bodies: int, seed: int) -> None:
    compare_radii(shape, bodies, seed)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("bodies", LARGE)
def test_the_contraction_of_large_mechanisms_is_the_spectral_radius_of_a_dense_matrix(shape: str, bodies: int) -> None:
    compare_radii(shape, bodies, bodies)
