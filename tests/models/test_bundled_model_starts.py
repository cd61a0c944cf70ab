"""Bundled models load, and their loops are closed in position and velocity. Their reference numbers are well-formed. Reference
numbers that geometry alone gives at t = 0 are correct. Generated scenes match their description."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest

from tests.models.reference_file_reader import columns_of, evaluate, expected, load_expected
from tests.scalable_mechanisms import n_four_bar, revolute_chain
from tests.scene.bodies.notation_kinematics import Poses, gaps
from trunnion.basics.errors import SceneError
from trunnion.scene import load_scene, model_names, models_dir
from trunnion.scene.findings.findings_and_paths import parse_path
from trunnion.scene.overrides import apply

MODELS = [
    "andrews", "bricard", "cart_pole", "caught_carriage", "crank_slider", "crank_slider_free", "double_pendulum",
    "friction_identification", "governor", "hatch", "n_four_bar", "simple_pendulum", "spatial_slider_crank", "spherical_pendulum",
    "trifilar",
]  # fmt: skip
CLOSED = 1e-15
"""Allowed gap, m or rad: rounding of start values written with 16 digits, in mechanisms of about 1 m."""


def test_the_models_are_all_there():
    assert model_names() == MODELS
    assert (models_dir() / "bricard" / "scene.yaml").is_file()


def test_an_unknown_model_gets_a_hint():
    with pytest.raises(SceneError, match='did you mean "bricard"'):
        load_scene("brickard")


@pytest.mark.parametrize("name", MODELS)
def test_a_model_is_called_after_its_folder_and_says_what_it_is(name):
    scene = load_scene(name)
    assert scene.name == name
    assert scene.title
    assert scene.simulation.every is not None
    assert all(j.friction is None or j.friction.law is None for j in scene.joints.values())


SCENES = {**{name: load_scene(name) for name in MODELS}, "n_four_bar(5)": n_four_bar(5)}


@pytest.mark.parametrize("name", SCENES)
def test_start_values_close_every_loop(name):
    found = gaps(Poses(SCENES[name]))
    joints = SCENES[name].joints.items()
    assert set(found) == {n for n, j in joints if j.start is None and j.drive is None and j.type != "fixed"}
    for joint, gap in found.items():
        assert np.abs(gap).max() < CLOSED, joint


@pytest.mark.parametrize("name", SCENES)
def test_start_rates_keep_every_loop_closed(name):
    step = 1e-6  # with steps of 1e-6 s, central differences of second derivatives below 1e4 are precise to 1e-9
    before, after = (gaps(Poses(SCENES[name], t)) for t in (-step, step))
    for joint, gap in after.items():
        assert np.abs(gap - before[joint]).max() / (2 * step) < 1e-8, joint


@pytest.mark.parametrize("name", MODELS)
def test_reference_numbers_are_well_formed_and_name_parts_of_the_scene(name):
    entries = expected(name)
    assert entries
    for e in entries:
        assert e.tolerance >= 0
        assert e.origin.split()[0].strip(",;") in ("PUB", "REF", "EXACT")
        for column in columns_of(e.value) if e.value else ():
            path = parse_path(column)
            assert path is not None
            assert path[0] in (*SCENES[name].bodies, *SCENES[name].joints, *SCENES[name].forces, "energy"), column
        apply(SCENES[name], e.set)


GEOMETRY = {
    name: [e for e in expected(name) if e.at == 0 and e.value and "position" in e.value] for name in MODELS
}  # fmt: skip


def test_positions_at_the_start_are_those_of_the_reference():
    count = 0
    for name, entries in GEOMETRY.items():
        poses = Poses(SCENES[name])
        for e in entries:
            assert evaluate(e.value, poses.column) == pytest.approx(e.expect, abs=e.tolerance)
            count += 1
    assert count >= 3


def test_the_spatial_slider_crank_starts_with_the_published_velocities():
    step = 1e-6
    before, after = (Poses(SCENES["spatial_slider_crank"], t) for t in (-step, step))
    velocity = (after.point("rod", (0.15, 0, 0)) - before.point("rod", (0.15, 0, 0))) / (2 * step)
    np.testing.assert_allclose(velocity, (0.12, -0.24, 0), atol=1e-9)
    turn = after.R["rod"] @ before.R["rod"].T
    omega = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * step)
    np.testing.assert_allclose(omega, (1.92, -0.96, 0.48), atol=1e-9)
    now = Poses(SCENES["spatial_slider_crank"])
    np.testing.assert_allclose(now.R["rod"][:, 1], np.array([0, 2, -1]) / math.sqrt(5), atol=1e-15)


def test_the_governor_starts_with_relaxed_springs():
    poses = Poses(SCENES["governor"])
    for f in SCENES["governor"].forces.values():
        a, b = (poses.point(*end.split(".")) for end in f.between)
        assert np.linalg.norm(a - b) == pytest.approx(f.length, abs=1e-15)


def test_the_governors_rods_are_a_rod_and_a_point():
    m, p, length, side = 0.3, 5.0, 1.0, 0.01
    c = (m * length / 2 + p * length) / (m + p)
    across = m * (length**2 + side**2) / 12 + m * (c - length / 2) ** 2 + p * (length - c) ** 2
    for name, sign in (("rod_right", 1), ("rod_left", -1)):
        body = SCENES["governor"].bodies[name]
        assert body.mass == pytest.approx(m + p)
        assert body.center[0] == pytest.approx(sign * c, rel=1e-15)
        assert body.inertia == pytest.approx((m * 2 * side**2 / 12, across, across), rel=1e-14)


def test_the_generated_four_bar_is_the_bundled_one():
    bundled, made = (dataclasses.replace(s, name="", title="") for s in (SCENES["n_four_bar"], n_four_bar(2)))
    assert made == bundled


def test_the_chain_has_the_state_of_the_performance_anchor():
    scene = revolute_chain(6)
    for i, joint in enumerate(scene.joints.values()):
        assert joint.start.q == 0.3 * math.sin(1.7 * i + 0.2)
        assert joint.start.qd == 0.5 * math.cos(2.3 * i)
        assert joint.effort == 0.1 * math.sin(0.9 * i)
        assert joint.axis == "yz"[i % 2]
    np.testing.assert_allclose(Poses(revolute_chain(3), q=0.0).point("link3", "end"), (3, 0, 0))


@pytest.mark.parametrize("make", [n_four_bar, revolute_chain])
def test_a_generator_refuses_nothing_at_all(make):
    with pytest.raises(ValueError, match="at least one"):
        make(0)


def test_expressions_of_columns_are_sums_products_and_functions():
    values = {"a.q[1]": 3.0, "b.tip.position[2]": 4.0, "time": 2.0}
    assert evaluate("hypot(a.q[1], -b.tip.position[2]) - 1/2*time", values.__getitem__) == 4.0
    assert columns_of("hypot(a.q[1], -b.tip.position[2])") == ["a.q[1]", "b.tip.position[2]"]


@pytest.mark.parametrize(
    "text", ["a.q[b]", "__import__('os')", "a.f(1)", "max(a)", "a ** b", "[1]", "lambda: 1", "'x'", "a.q['b']"]
)
def test_nothing_else_is_an_expression_of_columns(text):
    with pytest.raises(ValueError, match="is not"):
        evaluate(text, lambda name: 1.0)


def test_a_wrong_reference_file_has_problems_with_lines(tmp_path):
    file = tmp_path / "reference.yaml"
    file.write_text("- {at: 1, value: a, expect: 1, tolerance: 1, origin: x}\n- {at: 1, expect: 1}\n")
    with pytest.raises(SceneError, match=r"reference\.yaml:2"):
        load_expected(file)


def test_loading_a_scene_imports_neither_numpy_nor_the_symbolic_library():
    code = (
        "import sys, trunnion.scene as s; s.load_scene('spherical_pendulum');"
        "print([m for m in ('casadi', 'numpy', 'matplotlib', 'pyarrow') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
