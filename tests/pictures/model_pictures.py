"""Pictures of the bundled models: ``python -m tests.pictures.model_pictures [MODEL...]`` draws ``mechanism.png`` and
``curves.png`` into each model's folder. The same kernel and libraries give the same bytes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.pictures.designer_model_picture_settings import DESIGNS
from tests.pictures.picture_settings import Choice, Plot
from trunnion.basics.errors import Problem, SceneError
from trunnion.elements.friction import DEFAULT
from trunnion.plots.curves.curve_page import page, window
from trunnion.plots.curves.panel_selection import Panel, Section, family, pretty, sections
from trunnion.plots.mechanism_pictures.instant_picture import mechanism
from trunnion.plots.style.figure_files import save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trunnion.simulation.results.result import Result

MECHANISM, CURVES = "mechanism.png", "curves.png"
DPI = {MECHANISM: 100, CURVES: 88}
"""Dots per inch: pictures are wide enough for a README, and well below 150 kB each."""
RTOL = 1e-8
"""Relative tolerance of the runs in the pictures: the remaining error is invisible."""


LAW = {"friction.law": DEFAULT}
CHOICES: dict[str, Choice] = {
    "andrews": Choice(
        0.0072,
        "The motor spins the crank up; the squeezed linkage swings against the spring at every turn",
        (
            Plot("Crank (beta)", "angle", ("beta.q[1]",), True),
            Plot("Linkage", "angle", tuple(f"{n}.q[1]" for n in ("gamma", "Phi", "delta", "epsilon")), True),
        ),
        aside=(0.0, 70.0),
    ),
    "bricard": Choice(
        0.45,
        "One freedom: the three angles j0, j2, j4 are equal, and so are j1, j3, j5",
        (
            Plot("Point P3", "position", tuple(f"bar3.end.position[{k}]" for k in (1, 2, 3))),
            Plot("Joint angles", "angle", ("j0.q[1]", "j2.q[1]", "j4.q[1]", "j1.q[1]", "j3.q[1]"), True),
        ),
        aside=(30.0, 20.0),
    ),
    "caught_carriage": Choice(
        2.0,
        "Up at the speed of the motor, down on the hook, where it bounces; each bounce shakes the frame on its mount",
        (
            Plot("Carriage on its rail", "travel", ("rail.q[1]",)),
            Plot("Forces on the carriage along its rail", "force", ("rail.motor.effort[1]", "rail.latch.effort[1]")),
            Plot("Mount, along the rail", "length", ("mount.offset[1]",)),
        ),
        until=2.5,
        every=0.002,
        aside=(20.0, 15.0),
    ),
    "cart_pole": Choice(
        0.35,
        "The mass falls freely; as the pole passes the vertical the cart whips past under it",
        ("Joint angles", "Angular rates of the joints"),
        until=4.0,
        every=0.0,
        aside=(15.0, 12.0),
    ),
    "crank_slider": Choice(
        0.05,
        "Twice a turn the rod turns back: friction changes sign, and the contact normals jump by 33°",
        (
            "Friction torque of slider_pin",
            "Accelerations",
            "Where pin and bearing touch in slider_pin",
            "Normal contact forces in slider_pin",
        ),
        until=1.3,
        every=0.001,
        aside=(35.0, 18.0),
        changes=LAW,
    ),
    "crank_slider_free": Choice(
        0.3,
        "Launched at 10 rad/s and left alone: gravity and the moving masses change the crank's speed",
        ("Angular rates of the joints", "Joint travels"),
        until=4.0,
        aside=(20.0, 14.0),
    ),
    "double_pendulum": Choice(
        0.58,
        "Sliding stops near 13.75 m; until then the two contacts of the shaft press very differently",
        ("Joint travels", "Friction force of guide", "Where pin and bearing touch in guide", "Normal contact forces in guide"),
        until=6.0,
        aside=(20.0, 14.0),
        changes=LAW,
    ),
    "friction_identification": Choice(
        0.35,
        "At every stop friction turns round; how fast the swings die away, and how, tells friction from drag",
        (
            Plot("Angle of the arm", "angle", ("pivot.q[1]",), True),
            Plot("Friction torque of pivot", "torque", ("pivot.friction.torque[1]",)),
        ),
        aside=(20.0, 14.0),
        changes={"joints.pivot.friction.mu": 0.23, "joints.pivot.damping": 0.008},
    ),
    "governor": Choice(
        1.1116,
        "Balls and slider nod once a second; the fastest motion in the equations decays a thousand times faster",
        (
            Plot("Slider on the shaft", "height", ("guide.q[1]",)),
            Plot("Spin of the shaft", "angular rate", ("spin.qd[1]",)),
        ),
        until=5.0,
        every=0.0004,
        around=(1.1, 1.12),
        aside=(12.0, 12.0),
    ),
    "hatch": Choice(
        0.5,
        "The gas spring lifts the hatch, its damper slows it, and the stop in the strut catches it",
        (
            Plot("Angle of the hatch", "angle", ("hinge.q[1]",), True),
            Plot("Force with which the strut pulls", "force", ("strut.force",)),
        ),
        aside=(20.0, 14.0),
    ),
    "trifilar": Choice(
        0.0,
        "The plate twists by 60° to both sides; its rods pull most as it passes the middle, where it is lowest",
        (
            Plot("Sine of half the twist", "quaternion", ("hang.q[7]",)),
            Plot("Height of the plate", "position", ("hang.q[3]",)),
            Plot("Force of a rod", "force", ("rod_a.axial_force",)),
        ),
        aside=(25.0, 15.0),
    ),
    "n_four_bar": Choice(
        4.7,
        "Five turns in 10 s, ten times through the singular horizontal, and the cranks stay parallel",
        (
            Plot("Tip of the first crank", "position", ("crank0.tip.position[1]", "crank0.tip.position[2]")),
            Plot("Rates of the cranks", "angular rate", tuple(f"pivot{k}.qd[1]" for k in (0, 1, 2))),
        ),
        aside=(20.0, 14.0),
    ),
    "simple_pendulum": Choice(
        0.4,
        "From the horizontal to the horizontal and back in 2.3678 s",
        (
            Plot("Position of the bob", "position", ("bob.position[1]", "bob.position[2]")),
            Plot("Velocity of the bob", "velocity", ("bob.velocity[1]", "bob.velocity[2]")),
        ),
        aside=(20.0, 14.0),
    ),
    "spatial_slider_crank": Choice(
        0.15,
        "Slider and rod give their energy to the crank and take it back: it turns at 5 to 25 rad/s",
        (
            Plot("Slider", "travel", ("guide.q[1]",)),
            Plot("Crank", "angular rate", ("crank_pivot.qd[1]",)),
        ),
        until=2.0,
        aside=(50.0, 22.0),
    ),
    "spherical_pendulum": Choice(
        0.6,
        "At every stop friction turns round, and the contact point jumps by 58°: a possible impact",
        (
            "Friction torque of ball",
            "Angular acceleration of ball",
            "Where pin and bearing touch in ball",
            "Normal contact forces in ball",
        ),
        aside=(20.0, 14.0),
        changes=LAW,
    ),
}


def chosen(name: str) -> Choice:
    """The picture settings of a model or design."""
    return CHOICES[name] if name in CHOICES else DESIGNS[name]


def run(name: str) -> Result:
    """The result of the run in the picture."""
    from trunnion.simulation.run import simulate

    c = chosen(name)
    return simulate(name, until=c.until, every=c.every, rtol=RTOL, overrides=c.changes, outputs=["*"])


def pictures(name: str) -> dict[str, Figure]:
    """Both pictures of a model, by the names of the files."""
    c, result = chosen(name), run(name)
    seen = window(result, c.around) if c.around else result
    section = Section(c.says, tuple(_panel(result, p) for p in c.curves))
    return {MECHANISM: mechanism(seen, c.at, aside=c.aside), CURVES: page(result, [section])}


def _panel(result: Result, chosen: str | Plot) -> Panel:
    """The panel that ``figure`` draws under a title, or a panel of the columns that a Plot names."""
    if isinstance(chosen, str):
        return next(p for s in sections(result) for p in s.panels if p.title == chosen)
    curves, hidden = family(result, chosen.columns, float(np.degrees(1.0)) if chosen.degrees else 1.0)
    unit = "°" if chosen.degrees else pretty(result.units[curves[0].label])
    return Panel(chosen.title, chosen.quantity, unit, tuple(curves), hidden=hidden)


def draw(name: str, folder: Path) -> list[Path]:
    """Write the pictures of a model into a folder. Returns their paths."""
    return [save_figure(fig, folder / file, DPI[file]) for file, fig in pictures(name).items()]


def main(words: list[str]) -> int:
    """Draw the named models and designs, or all of them."""
    from trunnion.scene.library.model_folders import model_folder

    known = [*CHOICES, *DESIGNS]
    try:
        unknown = [w for w in words if w not in known]
        if unknown:
            raise SceneError([Problem(w, "the gallery has no such model", f"one of {', '.join(known)}") for w in unknown])
        for name in words or known:
            for path in draw(name, model_folder(name)):
                print(f"{path} ({path.stat().st_size // 1000} kB)")
    except SceneError as e:
        print(e, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
