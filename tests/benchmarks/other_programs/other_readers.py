"""How other readers read two URDF joints and an MJCF hinge. The script runs in environments without Trunnion:

    PYTHON tests/benchmarks/other_programs/other_readers.py        # rows of the readers that this Python has, as JSON

``comparison_page`` makes the page from these rows. Each reader runs in a separate process."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

LINK = '<link name="{0}"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>' \
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'  # fmt: skip
HINGE = '<joint name="{0}" type="revolute"><parent link="base"/><child link="{1}"/><axis xyz="0 1 0"/>' \
    '<limit lower="-3" upper="3" effort="10" velocity="5"/>{2}</joint>'  # fmt: skip
ARMS = (
    '<robot name="arms"><link name="base"/>' + LINK.format("a") + LINK.format("b")
    + HINGE.format("j", "a", '<dynamics damping="0.3" friction="0.7"/>')
    + HINGE.format("k", "b", '<mimic joint="j" multiplier="2" offset="0.1"/>') + "</robot>"
)  # fmt: skip
OTHER = '<robot name="other"><link name="base"/>' + LINK.format("a") + \
    '<joint name="j" type="{0}"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/></joint></robot>'  # fmt: skip
MJCF = (
    '<mujoco model="hinge"><compiler angle="radian"/><worldbody><body name="a"><joint name="j" axis="0 1 0" range="-1 1" '
    'damping="0.2" frictionloss="0.5" armature="0.03" stiffness="4" springref="0.3" ref="0.1"/>'
    '<inertial pos="0 0 -0.5" mass="1" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>'
)
FILES = {"arms": ARMS, "planar": OTHER.format("planar"), "floating": OTHER.format("floating"), "mjcf": MJCF}
Row = dict[str, str]


def short(x: Any) -> str:
    """A number with up to four digits; a list of such numbers."""
    return " ".join(map(short, x)) if hasattr(x, "__len__") and not isinstance(x, str) else f"{float(x):.4g}"


def freedoms(nv: int) -> str:
    return f"{nv} freedom{'s' * (nv != 1)}"


def mujoco(files: dict[str, str]) -> Row:
    import mujoco as mj

    m, plane, free, hinge = (mj.MjModel.from_xml_path(files[n]) for n in ("arms", "planar", "floating", "mjcf"))
    axes = short(abs(plane.jnt_axis[2]).round(6))
    return {
        "friction": short(m.dof_frictionloss[0]), "damping": short(m.dof_damping[0]),
        "mimic": f"{m.neq} equality, coefficients {short(m.eq_data[0, :2])}",
        "limits": f"{short(m.jnt_range[0])}, effort {short(m.jnt_actfrcrange[0])}",
        "planar": f"{freedoms(plane.nv)}, turns about {axes}", "floating": freedoms(free.nv),
        "mjcf": f"damping {short(hinge.dof_damping)}, friction {short(hinge.dof_frictionloss)}, "
        f"armature {short(hinge.dof_armature)}, stiffness {short(hinge.jnt_stiffness)} rest {short(hinge.qpos_spring)}, "
        f"limits {short(hinge.jnt_range[0])}",
    }  # fmt: skip


def pin(files: dict[str, str]) -> Row:
    import numpy as np
    import pinocchio

    plain, coupled = (pinocchio.buildModelFromUrdf(files["arms"], mimic=m) for m in (False, True))
    plane, free = (pinocchio.buildModelFromUrdf(files[n]) for n in ("planar", "floating"))
    h = pinocchio.buildModelFromMJCF(files["mjcf"])
    rate = np.array([0.0, 0.0, 1.0])
    slowed = abs(pinocchio.aba(plain, plain.createData(), np.zeros(2), np.array([1.0, 0.0]), np.zeros(2))[0]) > 1e-9
    used = "" if slowed else "; `aba` does not use it"
    data = plane.createData()
    pinocchio.forwardKinematics(plane, data, pinocchio.neutral(plane), rate)
    spin = data.v[1].angular
    return {
        "friction": f"{short(plain.friction[0])}{used}", "damping": f"{short(plain.damping[0])}{used}",
        "mimic": f"left out by default ({plain.nv} rates); with `mimic=True` {coupled.nv}",
        "limits": f"{short([plain.lowerPositionLimit[0], plain.upperPositionLimit[0]])}, effort {short(plain.effortLimit[0])}",
        "planar": f"{freedoms(plane.nv)}, turns about {short(spin)}: the axis is not used", "floating": freedoms(free.nv),
        "mjcf": f"damping {short(h.damping)}, friction {short(h.friction)}, armature {short(h.armature)}, stiffness left out, "
        f"limits {short([h.lowerPositionLimit[0], h.upperPositionLimit[0]])}",
    }  # fmt: skip


def drake(files: dict[str, str]) -> Row:
    import logging

    from pydrake.all import MultibodyPlant, Parser

    warned: list[str] = []
    logging.getLogger("drake").addFilter(lambda record: warned.append(record.getMessage()) or True)

    def told(word: str) -> str:
        return "left out, warning" if any(f"'{word}'" in text for text in warned) else "left out"

    def plant(name: str) -> Any:
        made = MultibodyPlant(0.001)
        Parser(made).AddModels(files[name])
        made.Finalize()
        return made

    m, plane, free, h = map(plant, ("arms", "planar", "floating", "mjcf"))
    j, hinge = m.GetJointByName("j"), h.GetJointByName("j")
    base = [m.get_joint(i).type_name() for i in m.GetJointIndices() if m.get_joint(i).name() == "base"]
    return {
        "friction": told("friction"), "damping": short(j.default_damping_vector()[0]), "mimic": f"{m.num_constraints()} coupler",
        "limits": f"{short([j.position_lower_limit(), j.position_upper_limit()])}; root: {', '.join(base) or 'fixed'}",
        "planar": f"joint of {freedoms(plane.GetJointByName('j').num_velocities())}",
        "floating": f"{told('j')}; {free.num_velocities()} rates",
        "mjcf": f"damping {short(hinge.default_damping_vector()[0])}, friction {told('frictionloss')}, "
        f"stiffness {told('stiffness')}, armature {told('armature')}, "
        f"limits {short([hinge.position_lower_limit(), hinge.position_upper_limit()])}",
    }  # fmt: skip


def dartpy(files: dict[str, str]) -> Row:
    import dartpy as dart

    load = dart.utils.DartLoader().parseSkeleton
    m, plane, free = (load(files[n]) for n in ("arms", "planar", "floating"))
    j, k = m.getJoint("j"), m.getJoint("k")
    kept = "kept" if j.areLimitsEnforced() else "read, not enforced by default"
    return {
        "friction": short(j.getCoulombFriction(0)), "damping": short(j.getDampingCoefficient(0)),
        "mimic": str(k.getActuatorType()).partition(".")[2].lower(),
        "limits": f"{short([j.getPositionLowerLimit(0), j.getPositionUpperLimit(0)])}, {kept}; root: {m.getRootJoint().getType()}",
        "planar": freedoms(plane.getJoint("j").getNumDofs()), "floating": freedoms(free.getJoint("j").getNumDofs()),
    }  # fmt: skip


def pybullet(files: dict[str, str]) -> Row:
    import pybullet as pb

    pb.connect(pb.DIRECT)
    arms = pb.loadURDF(files["arms"], useFixedBase=True)
    j, k = (pb.getJointInfo(arms, i) for i in (0, 1))
    kinds = {pb.JOINT_FIXED: "fixed", pb.JOINT_PLANAR: "planar", pb.JOINT_REVOLUTE: "revolute", pb.JOINT_SPHERICAL: "spherical"}

    def told(name: str) -> str:
        body = pb.loadURDF(files[name], useFixedBase=True)
        types = [pb.getJointInfo(body, i)[2] for i in range(pb.getNumJoints(body))]
        return f"joints of type {', '.join(kinds.get(t, str(t)) for t in types) or '(none)'}"

    return {
        "friction": short(j[7]), "damping": short(j[6]), "mimic": f"left out: `k` is {kinds.get(k[2], k[2])}",
        "limits": f"{short(j[8:10])}, effort {short(j[10])}", "planar": told("planar"), "floating": told("floating"),
    }  # fmt: skip


def newton(files: dict[str, str]) -> Row:
    import newton as nt

    def built(name: str) -> Any:
        b = nt.ModelBuilder()
        (b.add_mjcf if name == "mjcf" else b.add_urdf)(files[name])
        return b

    m, plane, free, h = map(built, ("arms", "planar", "floating", "mjcf"))
    return {
        "friction": short(m.joint_friction[0]), "damping": short(m.joint_damping[0]),
        "mimic": f"offset and ratio {short(m.joint_mimic_coeffs[-1])}",
        "limits": f"{short([m.joint_limit_lower[0], m.joint_limit_upper[0]])}, effort {short(m.joint_effort_limit[0])}",
        "planar": freedoms(plane.joint_dof_count), "floating": freedoms(free.joint_dof_count),
        "mjcf": f"damping {short(h.joint_damping)}, friction {short(h.joint_friction)}, armature {short(h.joint_armature)}, "
        f"limits {short([h.joint_limit_lower[0], h.joint_limit_upper[0]])}",
    }  # fmt: skip


def sapien(files: dict[str, str]) -> Row:
    import sapien as sp

    scenes: list[Any] = []

    def loaded(name: str) -> Any:
        # the variable keeps the scene alive, because a joint whose scene is deleted ends the process
        scenes.append(sp.Scene([sp.physx.PhysxCpuSystem()]))
        loader = scenes[-1].create_urdf_loader()
        loader.fix_root_link = True
        return loader.load(files[name])

    def told(name: str) -> str:
        try:
            return freedoms(loaded(name).dof)
        except Exception as error:  # noqa: BLE001  any exception of the reader is a result
            return f"{type(error).__name__}: {str(error)[:60]}"

    j = next(j for j in loaded("arms").joints if j.name == "j")
    return {
        "friction": short(j.friction), "damping": short(j.damping), "mimic": f"{loaded('arms').dof} freedoms",
        "limits": f"{short(j.limits[0])}, effort {short(j.force_limit)}", "planar": told("planar"), "floating": told("floating"),
    }  # fmt: skip


def yourdfpy(files: dict[str, str]) -> Row:
    from yourdfpy import URDF

    m, plane, free = (URDF.load(files[n]) for n in ("arms", "planar", "floating"))
    j, k = m.joint_map["j"], m.joint_map["k"]
    return {
        "friction": repr(j.dynamics.friction) + " (text)" * isinstance(j.dynamics.friction, str),
        "damping": repr(j.dynamics.damping) + " (text)" * isinstance(j.dynamics.damping, str),
        "mimic": f"multiplier {short(k.mimic.multiplier)}, offset {short(k.mimic.offset)}",
        "limits": f"{short([j.limit.lower, j.limit.upper])}, effort {short(j.limit.effort)}",
        "planar": freedoms(plane.num_dofs), "floating": freedoms(free.num_dofs),
    }  # fmt: skip


def idyntree(files: dict[str, str]) -> Row:
    import idyntree.bindings as idt

    def loaded(name: str) -> tuple[bool, Any]:
        loader = idt.ModelLoader()
        return loader.loadModelFromFile(files[name]), loader

    def told(name: str) -> str:
        done, loader = loaded(name)
        return f"error in the log, {'True' if done else 'False'} returned, {loader.model().getNrOfJoints()} joints"

    _, kept = loaded("arms")
    model = kept.model()
    j = model.getJoint(model.getJointIndex("j"))
    return {
        "friction": short(j.getStaticFriction(0)), "damping": short(j.getDamping(0)),
        "mimic": f"left out: {model.getNrOfDOFs()} freedoms",
        "limits": short([j.getMinPosLimit(0), j.getMaxPosLimit(0)]), "planar": told("planar"), "floating": told("floating"),
    }  # fmt: skip


SDFORMAT = """
#include <iostream>
#include <sdf/sdf.hh>
int main(int, char **a) {
  sdf::SDFPtr file(new sdf::SDF());
  sdf::init(file);
  bool read = sdf::readFile(a[1], file);
  std::cout << (read ? "" : "refused ") << file->ToString();
}
"""
"""Program in C++ that prints the SDF into which libsdformat turns a file."""
HEAVY = LINK.format("base")
"""The root link with a mass. Without a mass, libsdformat drops the root link and thereby the whole robot."""


def output(*words: str) -> str:
    """Standard output of a program that must succeed."""
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def libsdformat(files: dict[str, str]) -> Row:
    from xml.etree import ElementTree

    folder = Path(files["arms"]).parent
    (folder / "read.cc").write_text(SDFORMAT)
    flags = output("pkg-config", "--cflags", "--libs", "sdformat12").split()
    output("c++", str(folder / "read.cc"), "-o", str(folder / "read"), *flags)

    def joints(text: str) -> dict[str, ElementTree.Element]:
        (folder / "one.urdf").write_text(text)
        told = output(str(folder / "read"), str(folder / "one.urdf"))
        return {j.get("name", ""): j for j in ElementTree.fromstring(told).iter("joint")}

    def dropped(text: str) -> str:
        return "kept" if joints(text) else "dropped, `readFile` returns true"

    given = {name: text.replace('<link name="base"/>', HEAVY) for name, text in FILES.items()}
    made = joints(given["arms"])
    numbers = {e.tag: e.text or "" for e in made["j"].iter() if e.tag in ("friction", "damping", "lower", "upper", "effort")}
    k = {e.tag for e in made["k"].iter()}
    return {
        "friction": short(numbers["friction"]), "damping": short(numbers["damping"]),
        "mimic": "kept" if "mimic" in k else "left out",
        "limits": f"{short([numbers['lower'], numbers['upper']])}, effort {short(numbers['effort'])}; "
        f"with a massless root all joints {dropped(ARMS)}",
        "planar": dropped(given["planar"]), "floating": dropped(given["floating"]),
    }  # fmt: skip


READERS = {
    "libsdformat": ("libsdformat", libsdformat),
    "mujoco": ("MuJoCo", mujoco), "pin": ("Pinocchio", pin), "drake": ("Drake", drake), "dartpy": ("DART", dartpy),
    "pybullet": ("PyBullet", pybullet), "newton": ("Newton", newton),
    "sapien": ("SAPIEN", sapien), "yourdfpy": ("yourdfpy", yourdfpy),
    "idyntree": ("iDynTree", idyntree),
}  # fmt: skip
"""{package: (name of the program, function that gives its row)}."""


def row(package: str) -> Row:
    """The row of a reader, with its name and version."""
    name, read = READERS[package]
    with tempfile.TemporaryDirectory() as folder:
        places = {file: Path(folder) / f"{file}.{'xml' if file == 'mjcf' else 'urdf'}" for file in FILES}
        for file, text in FILES.items():
            places[file].write_text(text)
        cells = read({file: str(place) for file, place in places.items()})
    return {"program": name, "version": version_of(package), **cells}


def version_of(package: str) -> str:
    """Version of a package of this Python, or of libsdformat on this machine; "" if it is not installed."""
    if package == "libsdformat":
        tool = shutil.which("pkg-config") or "false"
        return subprocess.run([tool, "--modversion", "sdformat12"], capture_output=True, text=True, check=False).stdout.strip()
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def installed(package: str) -> bool:
    """Whether this machine has a program."""
    return bool(version_of(package))


def rows(script: str, packages: dict[str, Any]) -> list[Row]:
    """The rows of the installed packages. Each is the last text that ``script PACKAGE`` prints."""
    out = []
    for package in filter(installed, packages):
        done = subprocess.run([sys.executable, script, package], capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"{package}: {done.stderr[-2000:]}")
        found = done.stdout.rindex('[{"program"')  # some programs print text before their row
        out += json.loads(done.stdout[found:].splitlines()[0])
    return out


if __name__ == "__main__":
    print(json.dumps([row(sys.argv[1])] if sys.argv[1:] else rows(__file__, READERS)))
