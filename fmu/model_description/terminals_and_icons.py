"""The folder ``terminalsAndIcons`` of an FMU for FMI 3.0. Each joint has a terminal with effort and motion, so that tools can
connect mechanisms by terminals. The folder also has the mechanism's picture and icons of the terminals."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from trunnion.fmu.variables.fmi3_arrays import Face
from trunnion.fmu.xml_document import xml_bytes
from trunnion.simulation.run import Model
from trunnion.system.structure.bodies_and_joints import Joint

TURNS, SLIDES, MOVES = "rotational", "translational", "joint"
"""The kinds of terminals, which are also the names of their icons. TURNS and SLIDES: joints with one rotational or translational
degree of freedom. MOVES: all other joints."""
MEMBERS = {TURNS: ("phi", "w", "tau"), SLIDES: ("s", "v", "f"), MOVES: ("q", "qd", "effort")}
"""By kind of terminal: the member names of motion, rate and effort."""
SIGNAL, INFLOW = "signal", "inflow"
EDGE, HALF = 100.0, 8.0
"""EDGE: half the side of the FMU's icon. HALF: half the side of a terminal's icon."""


def terminals(model: Model, made: list[Face]) -> bytes:
    """``terminalsAndIcons.xml`` as bytes. made: the variables of the FMU."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    square = {"x1": f"{-EDGE}", "y1": f"{-EDGE}", "x2": f"{EDGE}", "y2": f"{EDGE}"}
    picture = SubElement(root, "GraphicalRepresentation")
    SubElement(picture, "CoordinateSystem", square | {"suggestedScalingFactorTo_mm": "0.1"})
    SubElement(picture, "Icon", square)
    names = {f.name for f in made}
    found = [(j, members) for j in model.system.joints if (members := list(_members(model, j, names)))]
    parent = SubElement(root, "Terminals") if found else root
    for i, (j, members) in enumerate(found):
        _terminal(parent, j, members, 2.0 * (i + 1) / (len(found) + 1) - 1.0)
    return xml_bytes(root)


def _terminal(parent: Element, j: Joint, members: list[tuple[str, str, str]], height: float) -> None:
    """Write a terminal. members: (variable, name in the terminal, kind) of each member. height: vertical position at the right side
    of the FMU's icon, from -1 to 1."""
    about = {"terminalKind": f"trunnion.{kind_of(j)}", "description": f"{j.kind_name} joint {j.name}"}
    node = SubElement(parent, "Terminal", {"name": j.name, "matchingRule": "plug", **about})
    for variable, name, kind in members:
        SubElement(node, "TerminalMemberVariable", {"variableName": variable, "memberName": name, "variableKind": kind})
    middle = -height * EDGE
    SubElement(node, "TerminalGraphicalRepresentation", {
        "x1": f"{EDGE - HALF}", "y1": f"{middle - HALF:.6g}", "x2": f"{EDGE + HALF}", "y2": f"{middle + HALF:.6g}",
        "iconBaseName": kind_of(j), "defaultConnectionColor": "0 0 0", "defaultConnectionStrokeSize": "0.5"})  # fmt: skip


def kind_of(j: Joint) -> str:
    """The kind of a joint's terminal."""
    return MOVES if j.kind.nv != 1 else TURNS if j.kind.turns(0) else SLIDES


def _members(model: Model, j: Joint, names: set[str]) -> Iterator[tuple[str, str, str]]:
    """The members (variable, name in the terminal, kind) for motion, rate, effort and friction, if the FMU has such variables.
    If an input sets a quantity, the variable is this input. Efforts are declared as inflows, even if they are outputs."""
    motion, rate, effort = MEMBERS[kind_of(j)]
    driven = [_input_of(model, d.drive) for d in j.devices]
    loaded = [_input_of(model, d.effort) for d in j.devices]
    one = j.kind.nv == 1
    yield from _of((driven[0] if one else "", f"{j.name}.q", f"{j.name}.q[1]"), motion, SIGNAL, names)
    yield from _of((f"{j.name}.qd", f"{j.name}.qd[1]"), rate, SIGNAL, names)
    for k in range(j.kind.nv):
        name = effort if one else f"{effort}_{k + 1}"
        yield from _of((loaded[k], f"{j.name}.drive.effort[{k + 1}]", f"{j.name}.effort[{k + 1}]"), name, INFLOW, names)
    for word in ("force", "torque"):
        yield from _of((f"{j.name}.friction.{word}", f"{j.name}.friction.{word}[1]"), f"friction_{word}", SIGNAL, names)


def _of(candidates: tuple[str, ...], member: str, kind: str, names: set[str]) -> Iterator[tuple[str, str, str]]:
    """A list with one member, for the first candidate that is a variable of the FMU. The list is empty if no candidate is a
    variable."""
    found = next((c for c in candidates if c in names), None)
    if found is not None:
        yield found, member, kind


def _input_of(model: Model, signal: object) -> str:
    """The name of the input if the signal is an input, else ""."""
    inputs = list(model.system.inputs)
    if getattr(signal, "kind", "") != "table" or getattr(signal, "index", len(inputs)) >= len(inputs):
        return ""
    return inputs[signal.index]  # type: ignore[attr-defined]


def icons(picture: bytes) -> dict[str, bytes]:
    """The icons by path in the archive: the mechanism's picture, and an icon for each kind of terminal."""
    return {"terminalsAndIcons/icon.png": picture} | {f"terminalsAndIcons/{kind}.png": _drawn(kind) for kind in MEMBERS}


def _drawn(kind: str) -> bytes:
    """The icon of a kind of terminal: a disc on a base for TURNS, a block for SLIDES, a ball for MOVES."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Rectangle

    figure = Figure(figsize=(0.64, 0.64))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-1, 1), ylim=(-1, 1), aspect="equal")
    axes.axis("off")
    look: dict[str, Any] = {"facecolor": "0.85", "edgecolor": "0.2", "linewidth": 1.5}
    axes.plot((-0.9, 0.9), (-0.8, -0.8), color="0.2", linewidth=2)
    if kind == SLIDES:
        axes.add_patch(Rectangle((-0.6, -0.7), 1.2, 0.8, **look))
    else:
        axes.add_patch(Circle((0.0, 0.0), 0.7, **look))
        axes.add_patch(Circle((0.0, 0.0), 0.2 if kind == TURNS else 0.45, facecolor="white", edgecolor="0.2"))
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=100, transparent=True, metadata={"Software": None})
    return out.getvalue()
