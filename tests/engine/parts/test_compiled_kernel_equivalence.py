"""A kernel made of parts equals the compiled kernel in every function and every run. No code is compiled for the kernel made of
parts."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

from tests.default_case_selection import sampled
from tests.engine.stick_slip.test_active_set_many_pairs import links
from tests.reference.scenes.random_scenes import random_loop, random_tree
from trunnion.kernel.compilation import c_compiler
from trunnion.kernel.shared_libraries import kernel
from trunnion.parts.kernels import scene_kernel
from trunnion.parts.kernels.scene_kernel import parts_kernel
from trunnion.runtime.abi.kernel_records import KERNEL
from trunnion.scene import load_scene
from trunnion.scene.data_classes.scene import Scene
from trunnion.scene.library.model_folders import model_names
from trunnion.simulation.run import simulate
from trunnion.system.construction.system_builder import Built, build

LAWS = ("coulomb", "regularized", "viscous", "lugre", "stribeck")
TREES = (0, 1, 2, 3, 8, 11)
"""Seeds of trees. Together they have every joint type in both directions, drives, loads, springs between bodies, stops, and every
law."""
LOOPS = (0, 1, 3, 4, 8)
"""Seeds of loops: with and without friction, with devices at the joint where they are cut, and with rows that are empty by
structure."""
MODELS = ("n_four_bar", "andrews", "bricard", "spatial_slider_crank")
RUNS = tuple(model_names())
ROUND_OFF = 1e-12
"""Allowed difference relative to the largest number that a function writes: the sums are the same, in another order."""
CANCELS = 1e-3
"""Below this result, numbers of order one have cancelled."""
SIZES = ("nq", "nv", "nb", "nx", "np", "rows", "active", "neta", "nn", "nrates", "npowers", "ntaken", "nsliders", "nstops",
         "npositions", "ntables", "nquat", "nelements", "npaces", "ndn", "sets", "nkappa", "nmore", "ndmore", "loop_friction",
         "coupled")  # fmt: skip

HELD = 0.01
"""Size of frictions at rest, N and N m; loads are of order 1 N."""


def tree(seed: int) -> Scene:
    """A random tree with every law."""
    return random_tree(seed, laws=LAWS).scene


def loop(seed: int) -> Scene:
    """A random mechanism with a loop and every law."""
    return random_loop(seed, laws=LAWS).scene


def called(table: Any, name: str, *arrays: np.ndarray) -> None:
    """Call a function of a kernel's table."""
    places = [*([table.scene] if name == "prepare" else []), *(a.ctypes.data for a in arrays)]
    ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(places))(getattr(table, name))(*places)


class State:
    """Random numbers for all arguments of a kernel's functions."""

    def __init__(self, built: Built, table: Any, seed: int):
        rng, system = np.random.default_rng(seed), built.system
        self.p = np.array([*built.parameters.values, 0.0])
        self.y = rng.normal(size=system.nq + system.nv + len(system.bristles) + 40)
        quaternions = (ctypes.c_int * (table.nquat + 1)).from_address(table.quat)[: table.nquat]
        for at in quaternions:
            self.y[at : at + 4] /= np.linalg.norm(self.y[at : at + 4])
        self.x = rng.normal(size=system.external.size)
        self.x[:2] = 0.7
        for k in range(system.stops):
            self.x[system.external.stop(k)] = rng.integers(2)
        for k in range(len(system.sliders)):
            mode = system.external.mode(k)
            self.x[mode], self.x[mode + 4] = rng.integers(2), 0.0
        self.z, self.v = rng.normal(size=table.active + system.neta + 4), rng.normal(size=system.nv + 4)
        self.u = HELD * rng.normal(size=table.neta + 4)
        self.N, self.r = rng.normal(size=table.nn + 4), rng.normal(size=table.nrates + 4)


def written(table: Any, s: State) -> dict[str, np.ndarray]:
    """The output of every function of a kernel."""
    c, w = np.zeros(table.nc + 8), np.zeros(table.nw + 64)
    sizes = {"maps": table.nmaps + 8, "dy": len(s.y), "power": table.npowers + 4, "dq": table.nq + 4,
             "eta": table.neta + 4, "dN": table.ndn + 8,
             "sliding": 3 * table.nsliders + 4, "hold": 3 * table.nsliders + 4, "dhold": 6 * table.nsliders + 4, "energy": 4,
             "closure": 2 * table.rows + 4, "more": table.nmore + 4, "dmore": table.ndmore + 8,
             "depths": 2 * table.nstops + table.npositions + 4,
             "eta alone": table.neta + 4, "hold alone": 3 * table.nsliders + 4}  # fmt: skip
    out = {name: np.zeros(size) for name, size in sizes.items()}
    called(table, "prepare", s.p, c)
    called(table, "stage1", s.x, s.y, c, w, out["maps"], out["dy"], out["power"])
    if table.neta + table.active:
        out["dy"][:] = out["power"][:] = 0.0  # if there are multipliers, stage 2 writes this output
        called(table, "stage2", s.x, s.y, c, w, s.z, out["dy"], out["power"])
    if table.rows:
        called(table, "closure", s.x, s.y, c[table.c_closure :], out["closure"])
    if table.nmore:
        called(table, "pressed", s.N, s.r, s.u, s.x, c[table.c_pressed :], out["more"], out["dmore"])
    if table.neta:
        called(table, "laws", s.N, s.r, s.x, c[table.c_laws :], out["eta"], out["dN"], out["sliding"])
        called(table, "laws_alone", s.N, s.r, s.x, c[table.c_laws :], out["eta alone"], out["sliding"])
        called(table, "held", s.N, s.r, s.x, c[table.c_held :], out["hold"], out["dhold"])
        called(table, "held_alone", s.N, s.r, s.x, c[table.c_held :], out["hold alone"])
    if table.energy:
        called(table, "energy", s.x, s.y, c[table.c_energy :], out["energy"])
    called(table, "events", s.x, s.y, c[table.c_events :], out["depths"])
    called(table, "qdot", s.y, s.v, c, out["dq"])
    return out


def agree(scene: Scene, redundant: bool = False) -> None:
    """Check that every function of a scene's two kernels writes the same numbers."""
    built = build(scene)
    one = kernel(built.system, len(built.parameters.values), [], False, redundant)
    compiled = KERNEL.ctype.in_dll(one.libraries["kernel"], "trunnion_kernel")
    other = parts_kernel(built.system, len(built.parameters.values), [], False, redundant)
    parts = other.tables["kernel"]
    assert other.facts["active_rows"] == one.facts["active_rows"]
    assert {n: getattr(parts, n) for n in SIZES} == {n: getattr(compiled, n) for n in SIZES}
    for number in range(3):
        state = State(built, parts, number)
        expected, found = written(compiled, state), written(parts, state)
        for name, values in expected.items():
            n = min(len(values), len(found[name]))  # the array is longer than the maps
            most = ROUND_OFF * max(np.abs(values).max(), CANCELS)
            np.testing.assert_allclose(found[name][:n], values[:n], rtol=0.0, atol=most, err_msg=name)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", TREES)
def test_every_function_of_a_kernel_writes_the_same_whether_compiled_or_made_of_parts(seed: int) -> None:
    agree(tree(seed))


OPEN = [(seed, redundant) for seed in LOOPS for redundant in (False, True)]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("seed", "redundant"), sampled(OPEN, lambda c: c[1] == LOOPS.index(c[0]) % 2))
def test_loops_with_and_without_the_choice_of_open_reactions_agree(seed: int, redundant: bool) -> None:
    """By default, half of the loops are tested with the choice of open reactions, the other half without the choice."""
    agree(loop(seed), redundant=redundant)


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("name", MODELS)
def test_rows_that_are_empty_by_structure_are_found_by_evaluation(name: str) -> None:
    agree(load_scene(name))


def named(scene: str | tuple) -> str:
    """A name of a scene that is the same in every process that collects tests."""
    return scene if isinstance(scene, str) else f"{scene[0].__name__}{scene[1]}"


SAME = [(scene, {"method": method}) for scene in (*RUNS, (tree, 2), (tree, 3), (loop, 1)) for method in ("auto", "rosenbrock")]
LONG = ("andrews", "rosenbrock")
"""A case whose Jacobian unit takes a third of a minute to compile."""


def settings() -> list:
    """All settings. The long-running setting is marked as slow."""
    ids = [f"{named(scene)}-{how['method']}" for scene, how in SAME]
    slow = [[pytest.mark.slow] if (scene, how["method"]) == LONG else [] for scene, how in SAME]
    return [pytest.param(*each, id=name, marks=marks) for each, name, marks in zip(SAME, ids, slow, strict=True)]


@pytest.mark.default_cases(1)
@pytest.mark.parametrize(("scene", "how"), settings())
def test_a_run_is_the_same_whether_compiled_or_made_of_parts(scene: str | tuple, how: dict) -> None:
    given = load_scene(scene) if isinstance(scene, str) else scene[0](scene[1])
    one, other = (simulate(given, until=1.0, every=0.1, rtol=1e-8, kernel=k, **how) for k in ("compiled", "parts"))
    assert one.settings["kernel"] == "compiled"
    assert other.settings["kernel"] == "parts"
    assert one.outcome.name == other.outcome.name
    assert [(e.kind, e.joint) for e in one.events] == [(e.kind, e.joint) for e in other.events]
    for name in [c.name for c in one.columns if c.key[0] in ("q", "qd", "reaction", "position", "kinetic", "potential")]:
        size = max(np.abs(one[name]).max(), 1e-3)
        assert np.abs(one[name] - other[name]).max() <= 1e-5 * size, name  # 1,000 × rtol: the effect of different round-off


def test_nothing_is_compiled_for_an_unseen_structure(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*given: object) -> None:
        raise AssertionError("a compiler was called")

    assert simulate(links(1, 0, "revolute", apart=False), until=0.1, kernel="parts").outcome.ok
    monkeypatch.setattr(c_compiler, "build_library", none)
    for count in (2, 7, 20):
        assert simulate(links(count, 0, "revolute", apart=False), until=0.1, kernel="parts").outcome.ok


def test_runs_that_differ_in_numbers_share_tables_and_equal_runs_with_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    def ends(mu: float) -> list[float]:
        changed = {"joints.slider_pin.friction.mu": mu}
        return [*simulate("crank_slider", until=0.2, every=0.1, kernel="parts", overrides=changed).data.ravel()]

    def none(*given: object) -> None:
        raise AssertionError("a table was made")

    ends(0.05)
    with monkeypatch.context() as shared:
        shared.setattr(scene_kernel, "table", none)
        found = ends(0.15)
    for kept in ("_evaluation", "_outputs"):
        monkeypatch.setattr(scene_kernel, kept, getattr(scene_kernel, kept).__wrapped__)
    assert found == ends(0.15) != ends(0.05)
