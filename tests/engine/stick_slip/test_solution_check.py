"""Independent code checks every accepted solution. The check detects each violated law and passes correct solutions. A run with a
wrong solution recovers, or reports the wrong solution."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest

from tests.engine.checks.right_hand_side import ENERGY, block_after
from tests.reference.scenes.random_friction_scenes import rubbing
from tests.reference.scenes.random_streams import stream
from trunnion import load_scene
from trunnion.runtime.abi import Breaks, PairState
from trunnion.runtime.abi.run_records import MODE
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface import simulation_block as bl
from trunnion.system.construction.start_values_and_scales import length_scale, rate_scale


def modes(block: bl.Block) -> np.ndarray:
    """The modes of a block's pairs, as a view into the block."""
    n = block.kernel.sizes["nsliders"]
    return block.x[len(block.x) - MODE.numbers * n :].view(MODE.dtype)


def solution(block: bl.Block) -> np.ndarray:
    """[λ | η] of a block, as a view into the block."""
    s = block.kernel.sizes
    return block._view(bl.Array.MULTIPLIERS, s["active"] + s["neta"])


def block_on_table(push: float = 0.0, speed: float = 0.0, law: str = "coulomb", mu: float = 0.5, lean: float = 0.0) -> sm.Scene:
    """A block of 2 kg on a rough table. The table is inclined by an angle, rad, and a force, N, pushes the block."""
    rub = sm.Friction(mu=mu, half_width=0.01, half_height=0.01, half_length=0.5)
    slide = sm.Joint("prismatic", "ground", "block", axis="x", pin="outboard", friction=rub, start=sm.Start(0.0, speed),
                     effort=push)  # fmt: skip
    gravity = (9.81 * math.sin(lean), 0.0, -9.81 * math.cos(lean))
    return sm.Scene({"block": sm.Body(mass=2.0, inertia=(0.1, 0.1, 0.1))}, {"slide": slide}, gravity=gravity,
                    friction=sm.FrictionDefaults(law=law))  # fmt: skip


def begun(scene: sm.Scene, method: str = "auto", kernel: str = "auto") -> bl.Block:
    """The scene's block at its start."""
    model = Model(scene, ENERGY, kernel)
    settings = bl.Settings(rtol=1e-8, method=method)
    model.block.configure(settings)
    assert model.block.assemble() == 1
    assert model.begin(settings, 0.0, 1.0, 1.0, np.zeros(model.block.width)) == bl.OK
    return model.block


# -- the violation of each law is detected ----------------------------------------------------------------------------------------


def test_a_held_block_that_is_given_other_friction_moves() -> None:
    block = begun(block_on_table(push=3.0))
    assert block.broken() == set()
    solution(block)[-1] *= 1.001
    assert block.broken() == {Breaks.REST}


@pytest.mark.parametrize(("off", "broken"), [(1e-7, set()), (1.5e-6, set()), (4e-6, {Breaks.LAW})])
def test_friction_is_measured_against_the_law_and_what_loads_it(off: float, broken: set) -> None:
    """The first check of a solution rejects an error of 1.5 parts in a million. This check knows the friction, but not the size of
    the load."""
    block = begun(block_on_table(speed=1.0))
    solution(block)[-1] *= 1.0 + off
    assert block.broken() == broken


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("name", ["spherical_pendulum", "double_pendulum", "crank_slider"])
def test_laws_and_limits_at_rest_are_the_same_without_their_derivatives(name: str) -> None:
    block = begun(load_scene(name), kernel="compiled")
    unit, sizes = block.kernel.libraries["kernel"], block.kernel.sizes
    rng = stream(name, "alone")
    N, r, u = rng.normal(size=sizes["nn"]), rng.normal(size=sizes["nrates"] + 9), rng.normal(size=sizes["neta"])
    constants = np.zeros(sizes["nc"])
    unit.k_prepare_all(None, ctypes.c_void_p(block.parameters.ctypes.data), ctypes.c_void_p(constants.ctypes.data))

    def called(function: str, first: np.ndarray, second: np.ndarray, part: str, *outs: int) -> list[np.ndarray]:
        """Call a function of the kernel that fills arrays of these lengths. Returns the arrays."""
        found = [np.zeros(n) for n in outs]
        pointer = [ctypes.c_void_p(a.ctypes.data) for a in (first, second, block.x, constants[sizes[part] :], *found)]
        getattr(unit, function)(*pointer)
        return found

    law, _, sliding = called("k_laws", N, r, "c_laws", sizes["neta"], sizes["ndn"], 3 * sizes["nsliders"])
    alone = called("k_laws_alone", N, r, "c_laws", sizes["neta"], 3 * sizes["nsliders"])
    assert np.abs(law).max() > 0.0
    np.testing.assert_allclose(np.concatenate(alone), np.concatenate([law, sliding]), rtol=1e-13)
    hold, _ = called("k_held", N, u, "c_held", 3 * sizes["nsliders"], 3 * sizes["nn"])
    np.testing.assert_allclose(called("k_held_alone", N, u, "c_held", 3 * sizes["nsliders"])[0], hold, rtol=1e-13)


def test_a_block_that_is_called_held_while_it_moves_is_not() -> None:
    block = begun(block_on_table(speed=1.0))
    modes(block)["flag"][0] = PairState.STUCK
    solution(block)[-1] = 0.0  # without a force along the table, the block does not accelerate
    assert block.broken() == {Breaks.REST}


def test_a_held_block_that_carries_more_than_it_can_breaks_its_cone() -> None:
    scene = block_on_table(lean=0.4)
    block = begun(scene)
    assert block.broken() == set()
    where = [i for i, p in enumerate(block.parameters) if p == 0.5]
    for i in where:
        block.parameters[i] = 0.4  # this coefficient is below tan(0.4)
    block.prepare()
    assert block.broken() == {Breaks.CONE}


def test_sliding_friction_that_is_not_its_laws_is_seen() -> None:
    block = begun(block_on_table(speed=1.0))
    assert block.broken() == set()
    solution(block)[-1] *= 1.00001
    assert block.broken() == {Breaks.LAW}


def test_sliding_friction_that_drives_is_seen() -> None:
    block = begun(block_on_table(speed=1.0))
    modes(block)["direction"][0][0] *= -1.0
    solution(block)[-1] *= -1.0
    assert block.broken() == {Breaks.POWER}


def test_a_block_that_starts_against_its_frictions_sense_is_seen() -> None:
    block = begun(block_on_table(push=20.0))
    assert block.broken(deciding=True) == set()
    modes(block)["direction"][0][0] *= -1.0
    solution(block)[-1] *= -1.0
    assert block.broken(deciding=True) == {Breaks.START}


def test_a_law_on_the_wrong_branch_is_seen() -> None:
    block = begun(block_on_table(speed=1.0, law="regularized"))
    assert block.broken() == set()
    modes(block)["flag"][0] = PairState.PROPORTIONAL
    block.evaluate()
    assert block.broken() == {Breaks.BRANCH}


def test_a_stop_that_presses_with_nothing_in_it_is_seen() -> None:
    slide = sm.Joint("prismatic", "ground", "block", axis="x", end_stops=sm.EndStops(upper=0.1, stiffness=1e4))
    block = begun(sm.Scene({"block": sm.Body(mass=2.0, inertia=(0.1, 0.1, 0.1))}, {"slide": slide}))
    assert block.broken() == set()
    block.x[len(block.x) - 1] = 1.0  # the scene has no pair, so the last number is the flag of the stop
    assert block.broken() == {Breaks.STOP}


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_loops_that_do_not_stay_closed_are_seen(seed: int) -> None:
    block = begun(rubbing("loop", seed).scene)
    z, a = solution(block), block.kernel.sizes["active"]
    right = z.copy()
    rng = stream("loops that open", seed)
    z[:a] += 0.01 * np.abs(right[:a]).max() * rng.normal(size=a)
    assert Breaks.LOOP in block.broken()


# -- right answers pass, in any mechanism -----------------------------------------------------------------------------------------


@pytest.mark.default_cases(3)
@pytest.mark.parametrize(
    ("kind", "seed"), [("tree", 0), ("tree", 1), ("tree", 2), ("tree", 3), ("loop", 0), ("loop", 1), ("loop", 6)]
)
def test_the_check_accepts_a_random_mechanisms_solution_and_refuses_its_neighbours(kind: str, seed: int) -> None:
    """The mechanism may have any size. A friction with an error of 1 % violates the law of its pair or the law of rest."""
    scene = rubbing(kind, seed).scene
    block = block_after(scene, 1.0 / rate_scale(scene, np.zeros(1), length_scale(scene)), 1e-6)
    block.evaluate()
    assert block.broken() == set()
    z, a = solution(block), block.kernel.sizes["active"]
    for i in range(a, len(z)):
        right = z[i]
        if abs(right) > 1e-3 * np.abs(z[a:]).max():
            z[i] = 1.01 * right
            assert block.broken() & {Breaks.LAW, Breaks.REST}, i
            z[i] = right


# -- a run does not continue with a wrong solution --------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["rk5", "rk8", "rosenbrock"])
def test_a_run_with_a_wrong_stick_mode_continues_to_slide(method: str) -> None:
    ends = []
    for wrong in (False, True):
        block = begun(block_on_table(speed=1.0, push=2.0), method=method)
        rows = np.empty((100, block.width))
        for until in (0.1, 0.5):
            while (code := block.advance(until, 1000, rows)[0]) != bl.DONE:
                assert code == bl.NEED_JACOBIAN
                block.attach_jacobian()
            if wrong and until == 0.1:
                modes(block)["flag"][0] = PairState.STUCK
        ends.append(block.y[:2].copy())
        assert (block.statistics()["refused"] > 0) == wrong
    assert ends[1] == pytest.approx(ends[0], rel=1e-6)
