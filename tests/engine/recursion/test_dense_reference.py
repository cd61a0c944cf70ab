"""The recursion gives the results of one dense solve in absolute coordinates. ``tests.reference`` shares no code with the
engine."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest

from tests.engine.checks.random_scene_properties import (
    DEVICES,
    DRIVES,
    Property,
    drives,
    pressed,
    rubs,
    sliding,
    some_cut,
    some_joint,
    some_load,
)
from tests.engine.checks.reference_comparison import engine_row, motion, reference_motion, results, worst
from tests.reference import NoRoot, solve
from tests.reference.scenes.random_components import RUBBING_TYPES
from tests.reference.scenes.random_scenes import CLOSING_TYPES, LATER, USUAL_TYPES, Case, covering, first, random_loop, random_tree
from tests.reference.scenes.result_table import table
from trunnion.elements.joints import REGISTRY
from trunnion.system.construction.spanning_tree import span

TIME = 0.3
"""At this time the value, rate and acceleration of ramps, tables and harmonic signals are all non-zero."""
TOLERANCE = 1e-10
"""Both sides solve to about 1e-14 times the condition of the mechanism (largest difference found: 8e-13). One missing velocity term
or a wrong sign causes 1e-3 and more."""
PINS = ("inboard", "outboard")
FRICTION = tuple(product(("regularized", "viscous"), (None, "adams")))
"""Combinations of a law and the way the normal force is found; the forms of every law are tested elsewhere."""
WITHOUT = ("angular_acceleration",)
"""Quantities of the reference for which the engine has no column."""


def tree_claims() -> dict[str, Property]:
    """Features each of which must occur in a random tree. They are made from the registered types and laws."""
    claims = {f"a {k} joint": some_joint(lambda j, k=k: j.type == k) for k in USUAL_TYPES}
    claims |= {
        f"a {k} joint that rubs, pin {p}": some_joint(lambda j, k=k, p=p: j.type == k and rubs(j, p))
        for k, p in product(RUBBING_TYPES, PINS)
    }
    claims |= {f"friction {x}, {n}": some_joint(lambda j, x=x, n=n: rubs(j, law=x, normal=n)) for x, n in FRICTION}
    claims |= {f"{d} in a joint": some_joint(lambda j, d=d: getattr(j, d) is not None) for d in DEVICES}
    claims |= {f"a {d} drive": some_joint(lambda j, d=d: any(getattr(x, d) is not None for x in drives(j))) for d in DRIVES}
    claims |= {
        f"a {kind} in the {frame} frame": some_load(lambda f, how=(kind, frame): (f.type, getattr(f, "frame", "")) == how)
        for kind, frame in (*product(("force", "torque"), ("world", "body")), ("spring_damper", ""))
    }
    return claims | {
        "a thrust face": some_joint(lambda j: rubs(j) and j.friction.thrust_radius),
        "a stop that presses": pressed,
        "sliding in the linear zone": sliding(inside=True),
        "sliding beyond it": sliding(inside=False),
    }


TREES = covering(tree_claims(), lambda seed: random_tree(seed, t=TIME), least=8)
CUTS = {
    f"{kind} cut, pin {pin}, {law}, {normal}": (kind, pin, law, normal)
    for n, kind in enumerate(RUBBING_TYPES)
    for m, pin in enumerate(PINS)
    for law, normal in [FRICTION[(n + 2 * m) % len(FRICTION)]]
}
PLAIN_CUTS = tuple(k for k in CLOSING_TYPES if REGISTRY[k].cuttable and k not in RUBBING_TYPES)
HELD = tuple(d for d in DEVICES if d != "drive")
"""Devices that a cut joint can have: driven joints are never cut."""


def has_solution(case: Case) -> bool:
    """Whether the reference finds forces for the state: a random loop can jam."""
    try:
        solve(case.state())
    except NoRoot:
        return False
    return True


@cache
def cut_case(which: str) -> Case:
    """A loop of few bodies, cut at a joint with friction, that does not jam. ``which`` gives the place of the pin, the law and the
    normal force."""
    kind, pin, law, normal = CUTS[which]
    how = {"bodies": 3, "closing": (kind,), "cut": True, "friction": 1.0, "laws": (law,), "adams": float(normal == "adams")}
    cut_so = some_cut(lambda j: j.type == kind and rubs(j, pin, law, normal))
    return first(
        f"{which}, all that rubs sliding",
        lambda c: cut_so(c) and all(np.abs(c.qd[n]).max() > 0.01 for n, j in c.scene.joints.items() if rubs(j)) and has_solution(c),
        lambda seed: random_loop(f"{kind}_{pin}{seed}", t=TIME, **how),
    )


@cache
def plain_cut_case(kind: str) -> Case:
    """A loop cut at a joint of a type without friction, with every device for which it has enough freedoms."""
    held = HELD if REGISTRY[kind].nv >= 3 else ()
    return first(
        f"{kind} cut, with {held}",
        some_cut(lambda j: j.type == kind and all(getattr(j, d) is not None for d in held)),
        lambda seed: random_loop(f"{kind}{seed}", t=TIME, closing=(kind,), cut=True, devices=1.0),
    )


@cache
def loops_case(which: int) -> Case:
    """A case of two loops whose joints have springs, dampers, stops, efforts and drives."""
    return random_loop(which, loops=2, t=TIME, devices=0.8)


def compared(case: Case) -> dict[str, float]:
    """All quantities of a state that both formulations give: accelerations, reactions, friction, contacts, motion, energy. Returns
    the engine's columns."""
    state = case.state()
    result = solve(state)
    model, row = engine_row(case)
    free = {(n, q) for n, j in case.scene.joints.items() if REGISTRY[j.type].nv == 6 for q in ("reaction.force", "reaction.torque")}
    expected = {k: v for k, v in table(result).items() if k not in free}
    gap, where = worst(expected, results(model, row), WITHOUT)
    assert gap <= TOLERANCE, where
    gap, where = worst(reference_motion(model, state), motion(model, row))
    assert gap <= TOLERANCE, where
    assert row["energy.potential"] == pytest.approx(result.potential, rel=TOLERANCE, abs=TOLERANCE)
    assert row["audit.complement"] <= 1e-12  # Newton's last step squares an error of 1e-7, so only round-off remains
    for name, friction in result.friction.items():
        mine = results(model, row)[name, "friction"]
        floor = -1e-14 * (np.abs(mine) + 1.0) @ np.abs(state.qd[name])  # round-off of the sum and, in N, of rates that are zero
        assert mine @ state.qd[name] >= floor, name  # friction on the inboard part points along the rates: it dissipates energy
        assert friction @ state.qd[name] >= floor, name
    return row


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", TREES)
def test_recursion_is_the_dense_solve_on_trees(seed: int) -> None:
    compared(TREES[seed])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("seed", range(4))
def test_joints_that_keep_points_on_lines_and_planes_equal_the_dense_reference(seed: int) -> None:
    compared(random_tree(f"points{seed}", t=TIME, types=(*LATER, "revolute")))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", CUTS)
def test_recursion_is_the_dense_solve_where_a_rubbing_joint_is_cut(which: str) -> None:
    compared(cut_case(which))


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("kind", PLAIN_CUTS)
def test_recursion_is_the_dense_solve_where_a_joint_without_friction_is_cut(kind: str) -> None:
    compared(plain_cut_case(kind))


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", range(3))
def test_recursion_is_the_dense_solve_on_two_loops(which: int) -> None:
    case = loops_case(which)
    assert len(span(case.scene).cut) == 2
    compared(case)


def test_every_type_is_cut_or_says_that_it_cannot_be() -> None:
    cuttable = {k for k, kind in REGISTRY.items() if kind.cuttable and kind.nv < 6 and not kind.bodiless}
    assert {k for k, *_ in CUTS.values()} | set(PLAIN_CUTS) == cuttable
    assert {(law, normal) for _, _, law, normal in CUTS.values()} == set(FRICTION)
