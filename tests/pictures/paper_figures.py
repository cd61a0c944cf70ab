"""The figures of the paper redrawn from our runs: ``python -m tests.pictures.paper_figures [FOLDER]`` (default:
``models/paper``).

Left: exact contact forms; right: friction as Adams computes it, (151) and (152). Solid: Coulomb's law; dashed: the paper's
regularised law (104) with v_eps = 1e-4 m/s. The script prints the numbers in the paper's text.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.elements.friction import DEFAULT, twin_of
from trunnion.plots.style.figure_files import reduce_colours, save_figure
from trunnion.plots.style.palette import GRID, INK, color
from trunnion.scene.library.model_folders import models_dir
from trunnion.simulation.results.result import Result
from trunnion.simulation.run import simulate

LAWS = {DEFAULT: ("-", 1.3), twin_of(DEFAULT): ("--", 1.0)}
NORMALS = {"exact": "exact contact forms", "adams": "as Adams computes it"}
V_EPS = 1e-4
"""The v_eps that the paper uses, m/s."""
Curve = Callable[[Result], np.ndarray]


@dataclass(frozen=True)
class Panel:
    """A figure of the paper: number, title, y label, curves by name, time span, s."""

    number: str
    title: str
    label: str
    curves: dict[str, Curve]
    span: tuple[float, float]
    changes: tuple[tuple[str, Any], ...] = ()


@lru_cache(maxsize=64)
def ran(model: str, law: str, normal: str, until: float, changes: tuple[tuple[str, Any], ...] = ()) -> Result:
    """A run, which is stored for later figures. The rows are so close that jumps look like jumps."""
    settings = {"friction.law": law, "friction.normal_force": normal, "friction.v_eps": V_EPS, **dict(changes)}
    return simulate(model, until, until / 4000, rtol=1e-8, overrides=settings)


def page(model: str, panels: Sequence[Panel], until: float) -> Any:
    """Panels in rows, with exact forms on the left and Adams' friction on the right."""
    from matplotlib.figure import Figure

    fig = Figure(figsize=(10.4, 0.55 + 2.45 * len(panels)), facecolor="white")
    height = fig.get_figheight()
    for column, (normal, words) in enumerate(NORMALS.items()):
        fig.text(0.075 + 0.495 * column, 1 - 0.22 / height, words, size=10.5, weight="bold", color=INK)
        for row, p in enumerate(panels):
            axes = fig.add_axes((0.075 + 0.495 * column, 1 - (0.62 + 2.45 * row + 1.72) / height, 0.415, 1.72 / height))
            _draw(axes, model, p, normal, until)
    return fig


def _draw(axes: Any, model: str, p: Panel, normal: str, until: float) -> None:
    for law, (dashes, width) in LAWS.items():
        result = ran(model, law, normal, until, p.changes)
        inside = (result.time >= p.span[0]) & (result.time <= p.span[1])
        for i, (name, curve) in enumerate(p.curves.items()):
            label = " ".join(x for x in (name, law) if x)
            y = curve(result)[inside]
            axes.plot(result.time[inside], y, ls=dashes, lw=width, color=color(2 * i + (law != DEFAULT)), label=label)
    axes.set_title(f"Fig. {p.number}: {p.title}", size=9, loc="left", color=INK, pad=4)
    axes.set_xlabel("time, s", size=8, labelpad=1)
    axes.set_ylabel(p.label, size=8)
    axes.set_xlim(*p.span)
    axes.tick_params(labelsize=7.5)
    axes.grid(True, color=GRID, lw=0.6)
    axes.legend(fontsize=6.5, loc="best", framealpha=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def column(name: str, factor: float = 1.0) -> Curve:
    """A function that reads a curve from a run: a column times a factor."""
    return lambda r: factor * r[name]


def degrees(name: str) -> Curve:
    """A function that reads a curve from a run: an angle in degrees, 0 to 360."""
    return lambda r: np.degrees(r[name]) % 360.0


def swing(r: Result) -> np.ndarray:
    """Angle of the first pendulum of 8.3 from the horizontal, in which it starts, degrees."""
    return np.degrees(r["guide.q[2]"])


def pages() -> dict[str, tuple[str, list[Panel], float]]:
    """All pages: file name → (model, panels, end time)."""
    ten, two = (0.0, 10.0), (0.0, 2.0)
    torque = {"": column("ball.friction.torque[2]")}
    coefficients = [
        Panel(str(n), f"frictional torque, μ = {mu:g}", "N m", torque, ten, (("joints.ball.friction.mu", mu),))
        for n, mu in ((16, 0.1), (17, 0.3), (18, 0.6), (19, 1.0))
    ]
    pin = "slider_pin"
    reverse = {"contact angle, °": degrees(f"{pin}.contact[1].angle"), "10 ω, rad/s": column("rod.angular_velocity[3]", 10)}
    return {
        "fig12_15": ("spherical_pendulum", [
            Panel("12, 14", "frictional torque in the spherical joint", "N m", torque, ten),
            Panel("13, 15", "angular acceleration", "rad/s²", {"": column("ball.qdd[2]")}, ten)], 10.0),
        "fig16_19": ("spherical_pendulum", coefficients, 10.0),
        "fig21_22": ("spherical_pendulum", [
            Panel("21", "orientation of the contact point", "°", {"": degrees("ball.contact[1].angle")}, ten),
            Panel("22", "normal contact force on the ball", "N", {"": column("ball.contact[1].normal_force")}, ten)], 10.0),
        "fig24": ("crank_slider", [
            Panel("24a", "velocity of the slider", "m/s", {"": column("slider.velocity[1]")}, two),
            Panel("24b", "acceleration of the slider", "m/s²", {"": column("slider.acceleration[1]")}, two)], 2.0),
        "fig25_28": ("crank_slider", [
            Panel("25", "frictional torque of the slider pin", "N m", {"": column(f"{pin}.friction.torque[1]")}, two),
            Panel("26", "contact angles", "°", {f"θ{i}": degrees(f"{pin}.contact[{i}].angle") for i in (1, 2)}, two),
            Panel("27", "normal contact forces", "N", {f"f{i}": column(f"{pin}.contact[{i}].normal_force") for i in (1, 2)}, two),
            Panel("28", "contact angle against the rod's angular velocity", "", reverse, (0.0, 0.7))], 2.0),
        "fig31_34": ("double_pendulum", [
            Panel("31", "position of the guide", "m", {"": column("guide.q[1]")}, ten),
            Panel("32", "velocity of the guide", "m/s", {"": column("guide.qd[1]")}, ten),
            Panel("33", "angular velocity of the first pendulum", "rad/s", {"": column("guide.qd[2]")}, (0.0, 60.0)),
            Panel("34", "swing angle of the first pendulum", "°", {"": swing}, (0.0, 60.0))], 60.0),
        "fig35_36": ("double_pendulum", [
            Panel("35a", "frictional force in the cylindrical joint", "N", {"": column("guide.friction.force")}, (0.0, 30.0)),
            Panel("35b", "frictional torque in the cylindrical joint", "N m", {"": column("guide.friction.torque[1]")},
                  (0.0, 30.0)),
            Panel("36", "frictional torques in the universal joint", "N m",
                  {f"axis {k}": column(f"cross.friction.torque[{k}]") for k in (1, 2)}, (0.0, 30.0))], 60.0),
        "fig37_38": ("double_pendulum", [
            Panel("37", "orientation of the two contacts in the cylindrical joint", "°",
                  {f"θ{i}": degrees(f"guide.contact[{i}].angle") for i in (1, 2)}, (0.0, 20.0)),
            Panel("38a", "normal contact forces, before 10 s", "N",
                  {f"f{i}": column(f"guide.contact[{i}].normal_force") for i in (1, 2)}, ten),
            Panel("38b", "normal contact forces, after 10 s", "N",
                  {f"f{i}": column(f"guide.contact[{i}].normal_force") for i in (1, 2)}, (10.0, 60.0))], 60.0),
    }  # fmt: skip


def numbers() -> list[tuple[str, str, str]]:
    """Rows (quantity of the paper's text, the text's value, our runs' value)."""
    adams = ran("spherical_pendulum", DEFAULT, "adams", 10.0)
    stops = [e.time for e in adams.events if e.kind in ("reversal", "stick")]
    exact = ran("spherical_pendulum", DEFAULT, "exact", 10.0)
    ends = [e.time for e in exact.events if e.kind in ("reversal", "stick")]
    rows = [
        ("8.1, Adams’ law: speed and acceleration both close to zero", "7.7 s", f"{min(stops, key=lambda t: abs(t - 7.7)):.4f} s"),
        ("8.1: at rest, sticking", "close to 10 s", f"{ends[-1]:.4f} s"),
        ("8.1: normal force at rest does not vanish", "–", f"{exact['ball.contact[1].normal_force'][-1]:.2f} N"),
    ]
    pin = ran("crank_slider", DEFAULT, "exact", 2.0)
    turns = [f"{np.degrees(e.turn[0]):.2f}° at {e.time:.4f} s" for e in pin.events[:2]]
    same = np.abs(pin["slider_pin.contact[1].normal_force"] - pin["slider_pin.contact[2].normal_force"]).max()
    rows += [
        ("8.2: abrupt changes of the contact angle in a turn", "two", f"{', '.join(turns)}"),
        ("8.2: f1 and f2 are equal", "equal", f"to {same:.0e} N"),
    ]
    for law in LAWS:
        rows += _travelled(law)
    return rows


def _travelled(law: str) -> list[tuple[str, str, str]]:
    """The pivot's travel that the text of example 8.3 gives, computed from a run with this law."""
    far = ran("double_pendulum", law, "exact", 60.0)
    x, v, f = far["guide.q[1]"], np.abs(far["guide.qd[1]"]), np.abs(far["guide.friction.force"])
    near = far.time[np.abs(x - x[-1]) > 0.01].max()
    return [
        (f"8.3, {law}: way of the pivot", "13.76 m", f"{x[-1]:.3f} m"),
        (f"8.3, {law}: pivot within 1 cm of it", "stops around 4.5 s", f"from {near:.2f} s"),
        (f"8.3, {law}: pivot's speed after 4 s", "never above 0.01 m/s", f"up to {v[far.time > 4].max():.2f} m/s"),
        (f"8.3, {law}: pivot's speed after 10 s", "never above 0.01 m/s", f"up to {v[far.time > 10].max():.4f} m/s"),
        (f"8.3, {law}: friction force along the guide above 5 N", "about 10 s after rest", f"until {far.time[f > 5].max():.1f} s"),
    ]


def main(arguments: Sequence[str] = ()) -> None:
    """Draw all pages into the folder, and print the numbers."""
    folder = Path(arguments[0]) if arguments else models_dir() / "paper"
    folder.mkdir(parents=True, exist_ok=True)
    for name, (model, panels, until) in pages().items():
        print(reduce_colours(save_figure(page(model, panels, until), folder / f"{name}.png", dpi=85)))
    for what, text, ours in numbers():
        print(f"| {what} | {text} | {ours} |")


if __name__ == "__main__":
    main(sys.argv[1:])
