"""The folder ``terminalsAndIcons`` of an FMU for FMI 3.0: terminals of the joints, the mechanism's picture, icons of terminals."""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from trunnion.fmu.variables.fmi3_arrays import Fmi3Variable
from trunnion.fmu.xml_document import xml_bytes
from trunnion.simulation.run import Model
from trunnion.system.structure.bodies_and_joints import Joint

TURNS, SLIDES, SENSES = "rotational", "translational", "joint"
"""The kinds of terminals, which are also the names of their icons. TURNS and SLIDES: flanges, through which another component
drives or loads a joint with one degree of freedom. SENSES: inputs and outputs of any other joint."""
FLANGE = "Modelica.Mechanics.{}.Interfaces.Flange_a"
KINDS = {TURNS: FLANGE.format("Rotational"), SLIDES: FLANGE.format("Translational"), SENSES: "_trunnion_joint"}
"""``terminalKind`` by kind of terminal. FMI 3.0 requires that the name of a tool's own kind begins with ``_`` and the name of the
tool."""
MEMBERS = {TURNS: ("phi", "tau"), SLIDES: ("s", "f")}
"""{kind: (motion, effort on the component)}: names of the members, as in the flanges of the Modelica library."""
SIGNAL, INFLOW = "signal", "inflow"
EDGE, HALF = 100.0, 8.0
"""EDGE: half the side of the FMU's icon. HALF: half the side of a terminal's icon."""


@dataclass(frozen=True)
class Terminal:
    """A terminal of a joint. members: (variable, name in the terminal, kind) of each member."""

    joint: Joint
    kind: str
    members: tuple[tuple[str, str, str], ...]


def terminals(model: Model, made: Iterable[Fmi3Variable]) -> list[Terminal]:
    """The terminals of the FMU. made: the variables of the FMU. Only inputs and outputs can be members of a terminal."""
    given = {f.name for f in made if f.first.causality in ("input", "output")}
    return [t for j in model.system.joints if (t := _flange(model, j, given) or _sensor(model, j, given)).members]


def _flange(model: Model, j: Joint, given: set[str]) -> Terminal | None:
    """The flange of a joint whose motion or effort is an input; None unless motion and effort are variables of the FMU."""
    if j.kind.nv != 1 or not j.devices:
        return None
    motion, effort = (_input_of(model, signal) for signal in (j.devices[0].drive, j.devices[0].effort))
    pair = motion or f"{j.name}.q[1]", effort or f"{j.name}.drive.effort[1]"
    if not (motion or effort) or not given.issuperset(pair):
        return None
    kind = TURNS if j.kind.turns(0) else SLIDES
    return Terminal(j, kind, tuple(zip(pair, MEMBERS[kind], (SIGNAL, INFLOW), strict=True)))


def _sensor(model: Model, j: Joint, given: set[str]) -> Terminal:
    """The terminal with all outputs of a joint and the inputs of the joint's devices. FMI's names <terminal>.<member> equal the
    names of the outputs."""
    of = f"{j.name}."
    inputs = {name for d in j.devices for s in (d.drive, d.effort) if (name := _input_of(model, s)) in given}
    found = [(n, n.removeprefix(of)) for n in sorted(given) if n.startswith(of)] + [(n, f"inputs.{n}") for n in sorted(inputs)]
    return Terminal(j, SENSES, tuple((variable, name, SIGNAL) for variable, name in found))


def _input_of(model: Model, signal: object) -> str:
    """The name of the input if the signal is an input, else ""."""
    inputs = list(model.system.inputs)
    if getattr(signal, "kind", "") != "table" or getattr(signal, "index", len(inputs)) >= len(inputs):
        return ""
    return inputs[signal.index]  # type: ignore[attr-defined]


def files(found: list[Terminal], picture: bytes) -> dict[str, bytes]:
    """The files by path in the archive: the description, the mechanism's picture, an icon for each kind of terminal."""
    made = {"terminalsAndIcons.xml": _described(found), "icon.png": picture}
    made |= {f"{kind}.png": _drawn(kind) for kind in sorted({t.kind for t in found})}
    return {f"terminalsAndIcons/{name}": content for name, content in made.items()}


def _described(found: list[Terminal]) -> bytes:
    """``terminalsAndIcons.xml``."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    square = {"x1": f"{-EDGE}", "y1": f"{-EDGE}", "x2": f"{EDGE}", "y2": f"{EDGE}"}
    picture = SubElement(root, "GraphicalRepresentation")
    SubElement(picture, "CoordinateSystem", square | {"suggestedScalingFactorTo_mm": "0.1"})
    SubElement(picture, "Icon", square)
    parent = SubElement(root, "Terminals") if found else root
    for i, t in enumerate(found):
        _terminal(parent, t, 2.0 * (i + 1) / (len(found) + 1) - 1.0)
    return xml_bytes(root)


def _terminal(parent: Element, t: Terminal, height: float) -> None:
    """Write a terminal. height: vertical position at the right side of the FMU's icon, from -1 to 1."""
    about = {"terminalKind": KINDS[t.kind], "description": f"{t.joint.kind_name} joint {t.joint.name}"}
    rule = "bus" if t.kind == SENSES else "plug"
    node = SubElement(parent, "Terminal", {"name": t.joint.name, "matchingRule": rule, **about})
    for variable, name, kind in t.members:
        SubElement(node, "TerminalMemberVariable", {"variableName": variable, "memberName": name, "variableKind": kind})
    middle = -height * EDGE
    SubElement(node, "TerminalGraphicalRepresentation", {
        "x1": f"{EDGE - HALF}", "y1": f"{middle - HALF:.6g}", "x2": f"{EDGE + HALF}", "y2": f"{middle + HALF:.6g}",
        "iconBaseName": t.kind, "defaultConnectionColor": "0 0 0", "defaultConnectionStrokeSize": "0.5"})  # fmt: skip


def _drawn(kind: str) -> bytes:
    """The icon of a kind of terminal: a disc on a base for TURNS, a block for SLIDES, a ball for SENSES."""
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
