"""Cases that are stepped together in SIMD lanes equal cases that are stepped alone, up to round-off. The cases in the other lanes
have no influence."""

from __future__ import annotations

import ctypes
from copy import copy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest

from trunnion.batch.plan_and_runner import Plan, Runner, Stopped, plan
from trunnion.kernel.compilation import c_compiler
from trunnion.kernel.compilation import library_cache as kept
from trunnion.kernel.units.simd_lanes_unit import FLAGS, FOLDER, WIDTH
from trunnion.scene.overrides import scene_given
from trunnion.simulation.settings.run_settings import Run

ROUND_OFF = 1e-9
"""Allowed difference relative to the largest value, over half a second with steps of equal length. Sums rounded in another order
cause this difference (measured: 1e-13)."""
TREE = """
schema: 1
gravity: [0, 0, -9.81]
bodies:
  first: {box: [0.5, 0.1, 0.08], density: 2700, center: [0.25, 0, 0], points: {end: [0.5, 0, 0]}}
  second: {box: [0.4, 0.05, 0.05], density: 2700, center: [0.2, 0, 0]}
joints:
  ball: {type: spherical, inboard: ground, outboard: first, start: {q: {axis: [0, 1, 0], angle: 0.3}, qd: [0, 1, 3]}}
  hinge: {type: revolute, axis: y, inboard: first.end, outboard: second, damping: 0.02, start: {q: 0.1, qd: 1},
          end_stops: {lower: -1, upper: 1, stiffness: 1000, damping: 1}}
simulation: {until: 0.5 s, every: 20 ms}
"""
SWEPT: dict[str, tuple[Any, str, tuple[str, ...]]] = {
    "loop": ("crank_slider_free", "joints.crank_pivot.start.qd", ("max:crank.angular_velocity[3]", "final:slider.position[1]")),
    "tree": (TREE, "joints.hinge.start.qd", ("max:hinge.qd[1]", "final:second.position[*]", "mean:ball.reaction.force[3]")),
}


@cache
def planned(which: str, kernel: str) -> Plan:
    given, path, keep = SWEPT[which]
    if given == TREE:
        import yaml

        given = yaml.safe_load(TREE)
    return plan(scene_given(given), {path: "-6:6:97"}, keep=keep, run=Run(until=0.5, every=0.02, kernel=kernel))


@cache
def runner(which: str, kernel: str) -> Runner:
    return Runner(planned(which, kernel))


@cache
def whole(which: str, kernel: str) -> pyarrow.Table:
    return runner(which, kernel).chunk(0, 97)


def numbers(table: pyarrow.Table) -> np.ndarray:
    """Reductions of all cases, one column for each."""
    names = [n for n in table.column_names if n.startswith(("max:", "min:", "mean:", "final:"))]
    return np.column_stack([table.column(n).to_numpy() for n in names])


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", SWEPT)
def test_cases_that_step_together_are_those_that_step_alone(which: str) -> None:
    together, alone = whole(which, "lanes"), whole(which, "compiled")
    loop = runner(which, "lanes").loops[0]
    assert loop.together is not None
    assert loop.together.all.asked > 97, "lanes were asked for nothing"
    assert together.column("outcome") == alone.column("outcome")
    assert together.column("steps") == alone.column("steps")
    a, b = numbers(together), numbers(alone)
    assert np.all(np.abs(a - b).max(axis=0) <= ROUND_OFF * np.abs(b).max(axis=0))
    assert np.any(a != b), "they are not compared with themselves"


@pytest.mark.default_cases(1)
@pytest.mark.parametrize("which", SWEPT)
def test_neighbours_change_no_bit(which: str) -> None:
    once = whole(which, "lanes")
    for cut in ((0, 1), (3, 10), (90, 97)):
        assert runner(which, "lanes").chunk(*cut).equals(once.slice(cut[0], cut[1] - cut[0]))
    _, path, keep = SWEPT[which]
    order = np.random.default_rng(7).permutation(97)
    values = once.column(path).to_numpy()
    other = plan(planned(which, "lanes").scene, cases=[{path: float(values[i])} for i in order], keep=keep,
                 run=planned(which, "lanes").run)  # fmt: skip
    assert np.array_equal(numbers(Runner(other).chunk(0, 97)), numbers(once)[order])


@pytest.mark.parametrize("which", SWEPT)
def test_the_check_of_solutions_refuses_no_step_of_the_lanes(which: str) -> None:
    """The check reads data that the lanes leave in memory. The check accepts every step, of cases in lanes and of a case that is
    stepped alone."""
    r = runner(which, "lanes")
    r.chunk(0, 8)
    assert r.loops[0].together is not None
    for batch in [b for b in r.loops[0].together.batches if b.now]:
        block = copy(r.loops[0].blocks[0])
        block.at = batch.now
        block._views()
        assert block.statistics()["refused"] == 0


def test_a_case_that_cannot_continue_has_the_outcome_of_its_single_run() -> None:
    most = float(np.median(whole("loop", "compiled").column("steps").to_numpy()))
    _, path, keep = SWEPT["loop"]
    runs = [Run(until=0.5, every=0.02, kernel=k, max_steps=most) for k in ("lanes", "compiled")]
    ends = [Runner(plan(planned("loop", "lanes").scene, {path: "-6:6:9"}, keep=keep, run=r)).chunk(0, 9) for r in runs]
    assert set(ends[1].column("outcome").to_pylist()) == {"done", "max_steps"}
    for name in ("outcome", "outcome.joint", "outcome.advice", "steps"):
        assert ends[0].column(name) == ends[1].column(name)


def test_a_cancelled_batch_returns_the_cases_that_have_ended() -> None:
    with pytest.raises(Stopped) as stop:
        Runner(planned("loop", "lanes")).chunk(0, 97, lambda done: False)  # the first call into C is short
    table = stop.value.table
    assert len(table) < 97
    rows = [table.column("case").to_pylist().index(i) for i in table.column("case").to_pylist()]
    assert np.array_equal(numbers(table)[rows], numbers(whole("loop", "lanes").take(table.column("case"))))


def rubbing(kernel: str, keep: tuple[str, ...], part: float = 0.0) -> tuple[Runner, pyarrow.Table]:
    """Example 8.1 spinning about all axes, with its friction changed by a relative amount."""
    rng = np.random.default_rng(3)
    cases = [{"joints.ball.friction.mu": float(rng.uniform(0.1, 0.6)) * (1.0 + part)}
             | {f"joints.ball.start.qd[{i}]": float(rng.uniform(-2, 2)) for i in (1, 2, 3)} for _ in range(24)]  # fmt: skip
    r = Runner(plan(scene_given("spherical_pendulum"), cases=cases, keep=keep, run=Run(until=0.6, every=0.01, kernel=kernel)))
    return r, r.chunk(0, 24)


def test_a_ball_that_rubs_steps_together_as_alone() -> None:
    """The difference is at most the effect of a change of the friction coefficient in its last place. Near the friction cone,
    friction keeps only half of its digits."""
    keep = ("max:ball.contact[1].normal_force", "final:pendulum.position[*]", "count:any")
    (runner, together), (_, alone) = rubbing("lanes", keep), rubbing("compiled", keep)
    assert runner.loops[0].together is not None
    steps = sum(together.column("steps").to_pylist())
    assert runner.loops[0].together.all.asked > steps, "a step asks for its stages and for its end"
    assert together.column("outcome") == alone.column("outcome")
    assert together.column("count:any") == alone.column("count:any")
    a, b = numbers(together), numbers(alone)
    digit = np.max([np.abs(numbers(rubbing("compiled", keep, p)[1]) - b).max(axis=0) for p in (2.0**-52, -(2.0**-52))], axis=0)
    assert np.all(np.abs(a - b).max(axis=0) <= 30 * digit)
    assert np.any(a != b), "they are not compared with themselves"
    assert runner.chunk(3, 10).equals(together.slice(3, 7))


def test_columns_that_need_all_of_an_evaluation_are_made_alone() -> None:
    keep = ("max:audit.complement", "max:audit.contraction")
    together, alone = (rubbing(kernel, keep)[1] for kernel in ("lanes", "compiled"))
    assert np.all(numbers(together)[:, 0] < 1e-9)
    assert np.allclose(numbers(together)[:, 1], numbers(alone)[:, 1], rtol=1e-6)


def test_a_scene_with_tables_steps_alone_whatever_was_asked() -> None:
    keep = ("final:carriage.position[*]",)
    tables = [Runner(plan(scene_given("caught_carriage"), {"gravity[3]": "-9.9:-9.7:3"}, keep=keep,
                          run=Run(until=0.1, every=0.02, kernel=k))).chunk(0, 3) for k in ("lanes", "compiled")]  # fmt: skip
    assert np.array_equal(numbers(tables[0]), numbers(tables[1]))


@pytest.mark.slow
def test_sine_and_cosine_are_right_to_one_unit_in_the_last_place(tmp_path: Path) -> None:
    text = f"#define WIDTH {WIDTH}\n" + (FOLDER / "vector_type.hpp").read_text(encoding="utf-8")
    text += 'extern "C" void both(const V*a,V*s,V*c,int n){for(int i=0;i<n;++i) s[i]=sin(a[i]),c[i]=cos(a[i]);}\n'
    (tmp_path / "circular.cpp").write_text(text)
    target = tmp_path / f"circular{c_compiler.library_suffix()}"
    c_compiler.build_library([tmp_path / "circular.cpp"], target, [], kept.cache_folder(), FLAGS)
    rng = np.random.default_rng(1)
    x = np.concatenate([rng.uniform(-b, b, 4000) for b in (1e-3, 0.8, 10.0, 1e3, 9e4, 1e9)] + [np.arange(-100, 100) * np.pi / 4])
    s, c = np.empty_like(x), np.empty_like(x)
    ctypes.CDLL(str(target)).both(*(ctypes.c_void_p(a.ctypes.data) for a in (x, s, c)), len(x) // WIDTH)
    for got, of in ((s, np.sin), (c, np.cos)):
        true = of(x.astype(np.longdouble))
        assert np.finfo(np.longdouble).nmant >= 60
        assert np.max(np.abs(got - true) / np.spacing(np.abs(true).astype(float))) < 1.0
