"""How readers of OpenUSD physics read twelve files with one joint each. The script runs in environments without Trunnion:

    PYTHON tests/benchmarks/other_programs/other_usd_readers.py        # rows of the readers that this Python has, as JSON

A base of 1 kg is fixed to the world. A joint about or along y connects it with an arm of 1 kg. ``comparison_page`` makes the page
from these rows. Numbers are in SI units with radians."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from other_readers import Row, installed, short

HEAD = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = {metres}
    kilogramsPerUnit = 1
    upAxis = "Z"
)
def Xform "World"
{{
    def PhysicsScene "scene"
    {{
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = {gravity}
    }}
    def Xform "robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
    {{
        def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
        {{
            float physics:mass = 1
            float3 physics:diagonalInertia = (0.01, 0.01, 0.01)
        }}
        def Xform "arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
        {{
            {mass}
        }}
        def PhysicsFixedJoint "root"
        {{
            rel physics:body1 = </World/robot/base>
        }}
        def {joint} "j" ({schemas})
        {{
            {axis}
            rel physics:body0 = </World/robot/base>
            rel physics:body1 = </World/robot/arm>
            {lines}
        }}
    }}
}}
"""
BALL = "float physics:mass = 1\n            float3 physics:diagonalInertia = (0.01, 0.02, 0.03)\n            " \
    "quatf physics:principalAxes = (1, 0, 0, 0)\n            point3f physics:centerOfMass = (0, 0, -0.5)"  # fmt: skip
TURNED = BALL.replace("(1, 0, 0, 0)", "(0.70710678, 0.70710678, 0, 0)")


def usda(kind: str, lines: str = "", schemas: str = "", mass: str = BALL, metres: float = 1.0, gravity: float = 9.81) -> str:
    """The text of a file with one joint. lines: further attributes of the joint; schemas: names of its applied schemas."""
    applied = f"prepend apiSchemas = [{schemas}]" if schemas else ""
    axis = 'uniform token physics:axis = "Y"' if kind in ("Revolute", "Prismatic") else ""
    words = {"schemas": applied, "axis": axis, "mass": mass, "metres": metres, "gravity": gravity}
    return HEAD.format(joint=f"Physics{kind}Joint", lines=lines.replace(";", "\n            "), **words)


def drive(kind: str) -> str:
    """Attributes of a drive: stiffness 10, damping 2, target 5, target rate 3, largest force 7."""
    values = {"stiffness": 10, "damping": 2, "targetPosition": 5, "targetVelocity": 3, "maxForce": 7}
    return ";".join(f"float drive:{kind}:physics:{name} = {value}" for name, value in values.items())


LIMITS = "float physics:lowerLimit = {};float physics:upperLimit = {}"
FILES = {
    "hinge limits": usda("Revolute", LIMITS.format(-30, 60)),
    "guide limits": usda("Prismatic", LIMITS.format(-0.1, 0.2)),
    "no limits": usda("Revolute"),
    "hinge drive": usda("Revolute", drive("angular"), '"PhysicsDriveAPI:angular"'),
    "guide drive": usda("Prismatic", drive("linear"), '"PhysicsDriveAPI:linear"'),
    "`PhysxJointAPI`": usda("Revolute", "float physxJoint:jointFriction = 0.3;float physxJoint:armature = 0.04", '"PhysxJointAPI"'),
    "`NewtonJointAPI`": usda("Revolute", "float newton:friction = 0.3;float newton:armature = 0.04", '"NewtonJointAPI"'),
    "principal axes": usda("Revolute", mass=TURNED),
    "no centre given": usda("Revolute", mass=BALL.rsplit("\n", 1)[0]),
    "centimetres": usda("Prismatic", LIMITS.format(-10, 20), metres=0.01, gravity=981.0),
    "ball": usda("Spherical", "float physics:coneAngle0Limit = 30;float physics:coneAngle1Limit = 30"),
    "target outside limits": usda(
        "Revolute",
        LIMITS.format(10, 30) + "".join(f";float drive:angular:physics:{x}" for x in ("stiffness = 10", "targetPosition = 90")),
        '"PhysicsDriveAPI:angular"',
    ),
}  # fmt: skip
"""{name of the column: text of the file}."""


def shown(name: str, read: dict[str, Any]) -> str:
    """The numbers that the file tests, from all numbers that a reader has read."""
    wanted = {
        "hinge drive": ("stiffness", "damping", "target", "rate", "effort"), "`PhysxJointAPI`": ("friction", "armature"),
        "`NewtonJointAPI`": ("friction", "armature"), "no centre given": ("centre",),
        "principal axes": ("inertia",), "centimetres": ("limits", "centre", "gravity"), "ball": ("freedoms", "limits"),
        "target outside limits": ("target",),
    }  # fmt: skip
    keys = wanted.get(name, wanted["hinge drive"] if name == "guide drive" else ("limits",))
    return ", ".join(f"{k} {short(read[k])}" if k in read else f"{k} –" for k in keys)


def newton(file: str) -> dict[str, Any]:
    import newton as nt

    b = nt.ModelBuilder()
    b.add_usd(file)
    arm, dof = b.body_label.index("/World/robot/arm"), 0
    return {
        "limits": [b.joint_limit_lower[dof], b.joint_limit_upper[dof]], "stiffness": b.joint_target_ke[dof],
        "damping": b.joint_target_kd[dof], "target": b.joint_target_q[dof], "rate": b.joint_target_qd[dof],
        "effort": b.joint_effort_limit[dof], "friction": b.joint_friction[dof], "armature": b.joint_armature[dof],
        "inertia": [b.body_inertia[arm][i, i] for i in range(3)], "centre": list(b.body_com[arm]), "gravity": -float(b.gravity[2]),
        "freedoms": b.joint_dof_count,
    }  # fmt: skip


def srl(file: str) -> dict[str, Any]:
    from xml.etree import ElementTree

    from nvidia.srl.from_usd.to_urdf import UsdToUrdf

    UsdToUrdf.init_from_file(file).save_to_file(file + ".urdf", quiet=True)
    robot = ElementTree.parse(file + ".urdf").getroot()
    joint = next(j for j in robot.iter("joint") if j.get("name", "").endswith("j"))
    arm = next(j for j in robot.iter("link") if j.get("name", "").endswith("arm"))
    limit, dynamics = joint.find("limit"), joint.find("dynamics")
    out: dict[str, Any] = {"freedoms": joint.get("type") not in ("fixed",)}
    if limit is not None:
        names = {"lower", "upper"} <= set(limit.keys())
        out |= {"limits": [float(limit.get(k, "nan")) for k in ("lower", "upper")]} if names else {}
        out |= {"effort": float(limit.get("effort", "nan"))}
    if dynamics is not None:
        out |= {k: float(v) for k, v in dynamics.items()}
    inertia, origin = arm.find("inertial/inertia"), arm.find("inertial/origin")
    out["inertia"] = [float(inertia.get(k)) for k in ("ixx", "iyy", "izz")]  # type: ignore[union-attr, arg-type]
    out["centre"] = [float(x) for x in (origin.get("xyz") or "0 0 0").split()]  # type: ignore[union-attr]
    return out


def ovphysx(file: str) -> dict[str, Any]:
    import numpy as np
    import ovphysx as ov
    import ovstage
    from ovphysx.samples.python_samples.schema_support import physx_schema_paths
    from ovphysx.types import TensorType as T

    ov.PhysX.set_cpu_mode(True)
    physx = ov.PhysX()
    ovstage.population.register_usd_schemas([*map(str, physx_schema_paths()), str(ov.newton_schema_root())])
    stage = ovstage.Stage("one")
    ovstage.population.open_usd(stage, file, ordinal=1, domains=ovstage.PopulationDomain.ALL)
    stage.advance_write_floor(ordinal=1).wait()
    physx.wait_task(physx.attach_ovstage(stage, read_ordinal=1))
    physx.wait_all()

    def get(kind: Any) -> Any:
        binding = physx.create_tensor_binding(pattern="/World/robot/base", tensor_type=kind)
        out = np.zeros(binding.shape, dtype=np.float32)
        binding.read(out)
        return out[0]

    dof = {
        "stiffness": T.ARTICULATION_DOF_STIFFNESS, "damping": T.ARTICULATION_DOF_DAMPING, "limits": T.ARTICULATION_DOF_LIMIT,
        "target": T.ARTICULATION_DOF_POSITION_TARGET, "rate": T.ARTICULATION_DOF_VELOCITY_TARGET,
        "effort": T.ARTICULATION_DOF_MAX_FORCE, "friction": T.ARTICULATION_DOF_FRICTION_PROPERTIES,
        "armature": T.ARTICULATION_DOF_ARMATURE,
    }  # fmt: skip
    read = {name: get(kind) for name, kind in dof.items()}
    out = {name: values[0] for name, values in read.items()} | {"freedoms": len(read["armature"])}
    return out | {"inertia": get(T.ARTICULATION_BODY_INERTIA)[1][0::4], "centre": get(T.ARTICULATION_BODY_COM_POSE)[1][:3]}


READERS = {
    "newton": ("Newton", newton), "ovphysx": ("PhysX (ovphysx)", ovphysx),
    "nvidia-srl-usd-to-urdf": ("nvidia-srl-usd-to-urdf", srl),
}  # fmt: skip
"""{package: (name of the program, function that reads a file)}."""


CELL = "read: "
"""Beginning of the line with a result. (Some programs print other lines, too.)"""


def cell(package: str, name: str) -> str:
    """The result of a reader for a file; the error if the reader refuses the file."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "one.usda"
        file.write_text(FILES[name])
        try:
            return shown(name, READERS[package][1](str(file)))
        except Exception as error:  # noqa: BLE001  any exception of the reader is a result
            return f"{type(error).__name__}: {str(error).splitlines()[0][:80]}"


def row(package: str) -> Row:
    """The row of a reader, with its name and version. Each file is read in a separate process, because PhysX holds only one
    stage."""
    cells = {}
    for name in FILES:
        done = subprocess.run([sys.executable, __file__, package, name], capture_output=True, text=True, check=True)
        cells[name] = next(line.removeprefix(CELL) for line in done.stdout.splitlines() if line.startswith(CELL))
    return {"program": READERS[package][0], "version": version(package), "settings": "OpenUSD physics", **cells}


if __name__ == "__main__":
    print(CELL + cell(*sys.argv[1:]) if sys.argv[1:] else json.dumps([row(package) for package in READERS if installed(package)]))
