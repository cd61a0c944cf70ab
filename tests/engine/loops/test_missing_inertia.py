"""If the joints allow a motion that moves no inertia, the start is refused, and the error names the freedom."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.default_case_selection import slow
from tests.reference.mechanics.newton_euler_equations import Equations
from tests.reference.scenes.random_scenes import Case, random_loop
from trunnion import Scene, SceneError, scene_from_dict, sweep
from trunnion.cli.output.scene_report import examined
from trunnion.simulation.execution.missing_inertia import freedoms_without_inertia
from trunnion.simulation.run import Model

G = 9.81
NOTHING = 1e-9
"""Mass, kg, and inertia, kg m², that count as none; the masses are about 1 kg, and lengths about 1 m."""


def lightened(case: Case, seed: int) -> Case:
    """The case in which about a third of the bodies are point masses, and another third have no mass."""
    rng = np.random.default_rng([11, seed])
    bodies = {}
    for name, b in case.scene.bodies.items():
        chance = rng.random()
        less: dict[str, Any] = {"box": None, "cylinder": None, "sphere": None, "density": None, "inertia": (0.0, 0.0, 0.0)}
        bodies[name] = b if chance > 0.7 else replace(b, **less, mass=1.0 if chance > 0.35 else 0.0)
    return replace(case, scene=replace(case.scene, bodies=bodies))


@pytest.mark.default_cases(3)
@pytest.mark.parametrize("seed", range(150))
def test_motions_without_inertia_are_counted_as_by_the_mass_matrix_of_one_dense_solve(seed: int) -> None:
    closing = {"closing": ("rod",)} if seed % 4 < 2 else {}
    case = lightened(random_loop(f"inertia{seed}", loops=1 + seed % 2, friction=0.0, **closing), seed)
    try:
        model = Model(case.scene, kernel="parts")
    except SceneError as e:
        refused = e.problems
    else:
        refused = ()
    if refused:
        assert all(p.what.startswith("the mass is 0, and no loop determines freedom") for p in refused)
        return
    assert model.block.assemble() == 1
    eq = Equations(case.state())
    sizes = np.linalg.eigvalsh(eq.null.T @ eq.M @ eq.null)
    lacking = freedoms_without_inertia(model)
    assert len(lacking) == int(np.sum(sizes < NOTHING))
    assert len({(j.name, k) for j, k in lacking}) == len(lacking)


def pendulum(inertia: float, link: bool) -> Scene:
    """A mass that hangs on a rod, or on a massless body between two balls."""
    bodies: dict[str, Any] = {"m": {"mass": 1, "inertia": [inertia] * 3, "position": [0, -0.7, 0]}}
    joints: dict[str, Any] = {"fly": {"type": "free", "inboard": "ground", "outboard": "m"}}
    if link:
        bodies["link"] = {"mass": 0, "inertia": [0, 0, 0], "position": [0, 0, 0]}
        joints |= {"near": {"type": "spherical", "inboard": "ground", "outboard": "link", "at": [0, 0, 0]},
                   "far": {"type": "spherical", "inboard": "link", "outboard": "m", "at": [0, -0.7, 0]}}  # fmt: skip
    else:
        joints["rod"] = {"type": "rod", "inboard": "ground", "outboard": "m"}
    return scene_from_dict({"gravity": [0, -G, 0], "bodies": bodies, "joints": joints, "simulation": {"until": 1}})


def start_of(scene: Scene) -> dict[str, Any]:
    """The start as ``trunnion check`` reports it."""
    return examined(scene)[0]["start"]


def test_check_names_the_spins_of_a_point_mass_and_of_a_body_without_mass_between_two_balls() -> None:
    spins = start_of(pendulum(0.0, link=False))
    assert (spins["outcome"], spins["joint"]) == ("no_inertia", "fly")
    assert all(f"freedom {k} of fly (rotation about e{k - 3})" in spins["advice"] for k in (4, 5, 6))
    link = start_of(pendulum(0.1, link=True))
    assert (link["outcome"], link["joint"]) == ("no_inertia", "near")
    assert link["advice"].endswith("Without inertia: freedom 2 of near (rotation about e2)")
    assert start_of(pendulum(0.1, link=False))["outcome"] == "ready"


@pytest.mark.parametrize("kernel", [slow("lanes"), "parts"])
def test_cases_of_a_sweep_end_with_missing_inertia(kernel: str) -> None:
    """For a link without mass, the recursion leaves a remainder of inertia. Without the examination of inertia, the spin of the
    link would be noise."""
    height = ["final:m.position[2]"]
    for scene in (pendulum(0.0, link=False), pendulum(0.1, link=True)):
        s = sweep(scene, {"bodies.m.mass": [1.0, 2.0]}, reductions=height, kernel=kernel)
        assert s.counts == {"no_inertia": 2}
    both = sweep(pendulum(0.1, link=False), {"bodies.m.inertia[1]": [0.0, 0.1]}, reductions=height, kernel=kernel)
    assert both.to_arrow()["outcome"].to_pylist() == ["no_inertia", "done"]


@pytest.mark.parametrize(("what", "outcome"), [("", "no_inertia"), ("rotor", "ready"), ("inertia", "ready")])
def test_links_without_mass_have_one_freedom_too_many_unless_something_turns_with_them(what: str, outcome: str) -> None:
    """Three links between a pivot and a block on a guide. They have two freedoms, and the block moves with only one of them."""
    bodies: dict[str, Any] = {"block": {"mass": 1, "inertia": [0.1] * 3}}
    bodies |= {f"l{k}": {"mass": 0, "inertia": [0, 0, 0], "points": {"end": [0.3, 0, 0]}} for k in range(3)}
    joints: dict[str, Any] = {"guide": {"type": "prismatic", "axis": "x", "inboard": "ground", "outboard": "block"}}
    for k, (one, two) in enumerate((("ground", "l0"), ("l0.end", "l1"), ("l1.end", "l2"), ("l2.end", "block"))):
        joints[f"p{k}"] = {"type": "revolute", "axis": "z", "inboard": one, "outboard": two}
    joints["p0"]["start"], joints["p1"]["start"] = {"q": 0.7}, {"q": -1.1}
    if what == "rotor":
        joints["p0"]["rotor_inertia"] = 0.1
    if what == "inertia":
        bodies["l1"]["inertia"] = [0.05, 0.05, 0.1]
    assert start_of(scene_from_dict({"gravity": [0, 0, 0], "bodies": bodies, "joints": joints}))["outcome"] == outcome
