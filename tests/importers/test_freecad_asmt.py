"""ASMT is the export format of FreeCAD's assemblies. Joints between markers move like the same mechanism in other formats."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trunnion
from trunnion.analysis.mechanics.state_evaluation import evaluate
from trunnion.basics.errors import SceneError
from trunnion.cli import main
from trunnion.importers import scene_of_asmt, scene_of_mjcf
from trunnion.scene.data_classes.scene import Scene
from trunnion.simulation.run import Model

E = np.eye(4)


def at(x: float, y: float, z: float, *turn: float) -> np.ndarray:
    out = np.eye(4)
    out[:3, 3] = (x, y, z)
    if turn:
        out[:3, :3] = Rotation.from_euler("xyz", turn).as_matrix()
    return out


def block(title: str, *lines: str | list[str]) -> list[str]:
    """A line, and its indented content below."""
    return [title, *(f"\t{x}" for line in lines for x in ([line] if isinstance(line, str) else line))]


def numbers(values: Sequence[float]) -> str:
    return "\t".join(f"{x:.17g}" for x in values) + "\t"


def placed(p: np.ndarray) -> list[str]:
    rows = [numbers(row) for row in p[:3, :3]]
    return [*block("Position3D", numbers(p[:3, 3])), *block("RotationMatrix", *rows)]


def markers(given: dict[str, np.ndarray]) -> list[str]:
    each = [block("Marker", block("Name", n), placed(p)) for n, p in given.items()]
    return block("RefPoints", *(block("RefPoint", placed(E), block("Markers", m)) for m in each))


def part(name: str, p: np.ndarray, marks: dict[str, np.ndarray], mass: float = 2.0, moments: Sequence[float] = (300, 400, 500),
         center: np.ndarray = E) -> list[str]:  # fmt: skip
    own = block("PrincipalMassMarker", block("Name", "MassMarker"), placed(center), block("Mass", f"{mass:.17g}"),
                block("MomentOfInertias", numbers(moments)), block("Density", "1"))  # fmt: skip
    still = [*block("Velocity3D", numbers([0, 0, 0])), *block("Omega3D", numbers([0, 0, 0]))]
    return block("Part", block("Name", f"Doc#{name}"), placed(p), still, own, markers(marks))


def joint(kind: str, name: str, i: str, j: str, *more: str | list[str]) -> list[str]:
    return block(kind, block("Name", f"Doc#{name}"), block("MarkerI", f"/A/{i}"), block("MarkerJ", f"/A/{j}"), *more)


def written(tmp_path: Path, parts: list[list[str]], joints: list[list[str]], ground: dict[str, np.ndarray]) -> Path:
    tied = block("ConstraintSets", block("Joints", *joints), "Motions")
    falls = block("ConstantGravity", numbers([0, 0, -9810]))
    lines = block("Assembly", block("Name", "A"), placed(E), markers(ground), block("Parts", *parts), tied, falls)
    file = tmp_path / "assembly.asmt"
    file.write_text("\n".join(["OndselSolver", *lines, "TimeSeries", "Number\tInput\t0"]))
    return file


def read(
    tmp_path: Path, parts: list[list[str]], joints: list[list[str]], ground: dict[str, np.ndarray]
) -> tuple[Scene, list[str]]:
    return scene_of_asmt(written(tmp_path, parts, joints, ground))


UPPER, LOWER = at(100, 0, 50, 0.3, 0.2, 0.1), at(400, 100, -60, -0.4, 0.5, 0.7)
HINGE, ELBOW = at(20, -30, 10, 0.6, -0.2, 0.3), at(250, 40, 0, 0.9, 0.1, -0.8)
MIDDLE = at(30, 20, -10, 0.2, 0.4, 0.6)


def arm(tmp_path: Path) -> tuple[Scene, list[str]]:
    """An arm with a hinge on the assembly and a slide on a part. The places are oblique."""
    slide = np.linalg.inv(LOWER) @ UPPER @ ELBOW @ at(0, 0, 70)
    parts = [part("upper", UPPER, {"h": HINGE, "e": ELBOW}, center=MIDDLE), part("lower", LOWER, {"e": slide}, center=MIDDLE)]
    rail = joint("TranslationalJoint", "rail", "Doc#upper/e", "Doc#lower/e")
    joints = [joint("RevoluteJoint", "hinge", "base", "Doc#upper/h"), rail]
    return read(tmp_path, parts, joints, {"base": UPPER @ HINGE})


def test_an_arm_moves_as_the_same_arm_in_mjcf(tmp_path: Path) -> None:
    """Millimetres become metres. A coordinate is zero at the drawn position of the parts."""
    one, _ = arm(tmp_path)
    text = lambda v: " ".join(f"{x:.17g}" for x in np.ravel(v))  # noqa: E731

    def body(name: str, rel: np.ndarray, inside: str) -> str:
        q, c = Rotation.from_matrix(rel[:3, :3]).as_quat(), Rotation.from_matrix(MIDDLE[:3, :3]).as_quat()
        turned = f'quat="{text(np.roll(c, 1))}"'
        weighed = f'<inertial pos="{text(MIDDLE[:3, 3] / 1000)}" {turned} mass="2" diaginertia="3e-4 4e-4 5e-4"/>'
        return f'<body name="{name}" pos="{text(rel[:3, 3] / 1000)}" quat="{text(np.roll(q, 1))}">{weighed}{inside}</body>'

    axis = np.linalg.inv(LOWER[:3, :3]) @ (UPPER @ ELBOW)[:3, 2]
    lower = body("lower", np.linalg.inv(UPPER) @ LOWER, f'<joint name="rail" type="slide" axis="{text(axis)}"/>')
    hinge = f'<joint name="hinge" pos="{text(HINGE[:3, 3] / 1000)}" axis="{text(HINGE[:3, 2])}"/>'
    (tmp_path / "arm.xml").write_text(f"<mujoco><worldbody>{body('upper', UPPER, hinge + lower)}</worldbody></mujoco>")
    two, _ = scene_of_mjcf(tmp_path / "arm.xml")
    q, qd = {"hinge": np.array([0.4]), "rail": np.array([0.03])}, {"hinge": np.array([1.2]), "rail": np.array([-0.5])}
    rows = [evaluate(Model(s, ("*.qdd[*",)), q, qd, 0.0) for s in (one, two)]
    for name in q:
        assert rows[0][f"{name}.qdd[1]"] == pytest.approx(rows[1][f"{name}.qdd[1]"], rel=1e-11), name


def test_parts_start_where_they_are_exported(tmp_path: Path) -> None:
    scene, notes = arm(tmp_path)
    r = trunnion.simulate(scene, 1e-6, 1e-6)
    for name, p in (("upper", UPPER), ("lower", LOWER)):
        found = [r[f"{name}.position[{k}]"][0] for k in (1, 2, 3)]
        assert found == pytest.approx((p @ MIDDLE)[:3, 3] / 1000, abs=1e-12)
    assert not notes


KINDS = {
    "RevoluteJoint": ("revolute", 1), "CylindricalJoint": ("cylindrical", 2), "TranslationalJoint": ("prismatic", 1),
    "SphericalJoint": ("spherical", 3), "UniversalJoint": ("universal", 2), "ScrewJoint": ("screw", 1),
    "PlanarJoint": ("planar", 3),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_every_joint_keeps_its_markers_as_it_should(kind: str, tmp_path: Path) -> None:
    """While the part falls and tumbles, the quantities that a joint of this kind keeps fixed do not change. The test computes them
    from the markers I and J in the world."""
    turned = at(0, 0, 0, 0, np.pi / 2, 0) if kind == "UniversalJoint" else E  # the axes of a universal joint are perpendicular
    pitch = block("pitch", "50") if kind == "ScrewJoint" else block("offset", "20") if kind == "PlanarJoint" else []
    base, J = at(100, 0, 0, 0.3, 0.2, 0.1), at(10, 20, 30, 0.5, -0.4, 0.2)
    shift = at(0, 0, -20) if kind == "PlanarJoint" else E
    stands = base @ turned @ shift @ np.linalg.inv(J)
    scene, _ = read(tmp_path, [part("p", stands, {"j": J}, center=MIDDLE)], [joint(kind, "k", "i", "Doc#p/j", pitch)], {"i": base})
    kind_here, freedoms = KINDS[kind]
    assert scene.joints["k"].type == kind_here
    r = trunnion.simulate(scene, 0.2, 0.1, rtol=1e-10)
    assert sum(name.startswith("k.qd[") for name in r.names) == freedoms
    last = {n: r[n][-1] for n in r.names}
    R = Rotation.from_quat(np.roll([last[f"p.orientation[{k}]"] for k in (1, 2, 3, 4)], -1)).as_matrix()
    spot = np.array([last[f"p.position[{k}]"] for k in (1, 2, 3)]) * 1000 + R @ (J[:3, 3] - MIDDLE[:3, 3])
    frame = R @ J[:3, :3]
    away, turn = base[:3, :3].T @ (spot - base[:3, 3]), base[:3, :3].T @ frame
    held = {
        "RevoluteJoint": [*away, *turn[:2, 2]], "CylindricalJoint": [*away[:2], *turn[:2, 2]],
        "TranslationalJoint": [*away[:2], *(turn - E[:3, :3]).ravel()], "SphericalJoint": [*away],
        "UniversalJoint": [*away, turn[2, 2]], "PlanarJoint": [away[2] + 20, *turn[:2, 2]],
        "ScrewJoint": [*away[:2], *turn[:2, 2], away[2] - 50 * last["k.q[1]"] / (2 * np.pi)] if kind == "ScrewJoint" else [],
    }[kind]  # fmt: skip
    assert np.abs(held).max() < 1e-9
    assert np.abs([last[f"p.velocity[{k}]"] for k in (1, 2, 3)]).max() > 1e-3


def test_four_hinges_close_a_loop(tmp_path: Path) -> None:
    """A square of links in the plane x–z swings. The test checks the loop's gap and the energy."""
    flat = at(0, 0, 0, np.pi / 2, 0, 0)
    ends = {"a": flat, "b": at(200, 0, 0) @ flat}
    parts = [part("left", at(0, 0, 0, 0, -1.2, 0), ends), part("top", at(200 * np.cos(1.2), 0, 200 * np.sin(1.2)), ends),
             part("right", at(200, 0, 0, 0, -1.2, 0), ends)]  # fmt: skip
    joints = [joint("RevoluteJoint", f"h{k}", i, j) for k, (i, j) in enumerate(
        [("o", "Doc#left/a"), ("Doc#left/b", "Doc#top/a"), ("Doc#top/b", "Doc#right/b"), ("p", "Doc#right/a")])]  # fmt: skip
    scene, _ = read(tmp_path, parts, joints, {"o": flat, "p": at(200, 0, 0) @ flat})
    r = trunnion.simulate(scene, 0.5, 0.05, rtol=1e-9)
    assert r.outcome.ok
    assert np.abs(r["energy.residual"]).max() < 1e-7
    assert r["h3.q[1]"] == pytest.approx(r["h0.q[1]"], abs=1e-8)
    assert np.ptp(r["h0.q[1]"]) > 0.1


def test_masses_that_freecad_only_guessed_are_reported(tmp_path: Path) -> None:
    moments = {"guessed": (1, 1, 1), "known": (1, 1, 2)}
    parts = [part(n, at(k, 0, 0), {}, mass=1.0, moments=m) for k, (n, m) in enumerate(moments.items())]
    scene, notes = read(tmp_path, parts, [], {})
    assert any("1 kg" in n and "guessed" in n and "known" not in n for n in notes)
    assert {j.type for j in scene.joints.values()} == {"free"}


REFUSED = {
    "another joint": (joint("GearJoint", "g", "o", "Doc#p/m"), "a GearJoint"),
    "no marker": (joint("RevoluteJoint", "g", "o", "Doc#p/nothing"), "not a marker"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_unsupported_content_is_refused_with_its_line(what: str, tmp_path: Path) -> None:
    lines, words = REFUSED[what]
    file = written(tmp_path, [part("p", E, {"m": E})], [lines], {"o": E})
    with pytest.raises(SceneError, match=words) as e:
        scene_of_asmt(file)
    place = next(k for k, line in enumerate(file.read_text().splitlines(), 1) if line.strip() == lines[0])
    assert [(p.line, p.file) for p in e.value.problems] == [(place, str(file))]


def test_the_command_takes_the_unit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path, [part("p", at(3, 0, 0), {})], [], {})
    assert main(["import", str(file), "--unit", "cm"]) == 0
    assert "start: {q: [0.03, 0, 0, 1, 0, 0, 0]}" in capsys.readouterr().out
    (tmp_path / "other.asmt").write_text("Something\n\t\telse\n")
    assert main(["import", str(tmp_path / "other.asmt")]) == 2
