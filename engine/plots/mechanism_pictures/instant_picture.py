"""The mechanism at an instant: bodies, joints, contact points and normal forces, drawn from back to front."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.basics.errors import Problem, SceneError
from trunnion.elements.joints import REGISTRY
from trunnion.plots.geometry.mechanism_geometry import Scenery, scenery
from trunnion.plots.geometry.motion_and_view import NEEDED, VIEW, arrow_scale, bounds, first_view, motion, rails, round_force
from trunnion.plots.mechanism_pictures.label_placement import label
from trunnion.plots.style.palette import ARROW, GRID, INK, JOINT, OPEN, STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from trunnion.plots.geometry.meshes import Mesh
    from trunnion.plots.geometry.motion_and_view import Motion
    from trunnion.scene.data_classes.scene import Scene
    from trunnion.simulation.results.result import Result

LIGHT = np.array([0.3, 0.65, 0.7]) / np.linalg.norm([0.3, 0.65, 0.7])
"""Direction of the light in the picture's axes (right, up, towards the viewer)."""
COPLANAR = 0.07
"""Depth that is added to each further body before faces are sorted, divided by a body's length. Without this shift, the pieces of
bodies in one plane would alternate like stripes."""
SIZE = (8.4, 6.0)
"""Width and height of the picture, inches."""
Polygon = tuple[float, np.ndarray, tuple[float, ...], tuple[float, ...]]
"""(depth, corners in the picture, fill colour, line colour)."""
COILS, WIDTH = 9, 0.05
"""COILS: number of corners of a spring's zigzag. WIDTH: half width of the zigzag, divided by its length."""
START_TIME, ASSEMBLY_TIME = 1e-3, 1e-9
"""Durations of short runs, as fractions of the scene's end time. START_TIME: for a picture at time 0. ASSEMBLY_TIME: for the
assembled start."""
ARROW_LOOK: dict[str, Any] = {"arrowstyle": "-|>", "color": ARROW, "lw": 1.4, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 11}


def mechanism(source: Scene | Result, time: float = 0.0, labels: bool = True, aside: tuple[float, float] = VIEW) -> Figure:
    """A picture of the mechanism at ``time``, s. A result is drawn at its row nearest to this time. A scene is simulated up to this
    time.

    aside: angles of the viewer to the left of the motion's front and above the horizontal, degrees.
    """
    from matplotlib.figure import Figure

    result = _result(source, time)
    scene = scenery(result.scene)
    moved = motion(result, [p.name for p in scene.parts])
    row = int(np.argmin(np.abs(result.time - time)))
    view = first_view(scene.up, *bounds(scene, moved), aside)
    fig = Figure(figsize=(SIZE[0], SIZE[1]), facecolor="white")
    axes = fig.add_axes((0.0, 0.0, 1.0, 0.89))
    axes.axis("off")
    seen = [draw_bodies(axes, view, scene, moved, row)]
    _rails(axes, view, scene, moved, result, row)
    _springs_and_rods(axes, view, scene, moved, row, seen)
    scale = arrow_scale(result, scene)
    states = _contacts(axes, view, scene, moved, result, row, seen)
    set_limits(axes, np.concatenate(seen))
    _grid(axes, view, scene, np.concatenate(seen))
    if labels:
        label(axes, view, scene, moved, row)
    _captions(fig, result, row, states)
    if states:
        _arrow_legend(axes, scale, round_force(scale, scene.size))
    return fig


def assemble_start(scene: Scene, where: str) -> Result:
    """A result whose only row is the start, with all columns that pictures need. where: place that problems name. SceneError if the
    scene cannot be assembled."""
    from trunnion.simulation.run import simulate

    soon = ASSEMBLY_TIME * float(scene.simulation.until)
    result = started(simulate(scene, until=soon, every=soon, outputs=needed(scene)), where)
    return replace(result, data=result.data[:1], events=())


def started(result: Result, where: str) -> Result:
    """The result, if one of its rows can be drawn. Otherwise SceneError with the outcome, at the place ``where``."""
    from trunnion.simulation.results.summary import has_motion

    if not has_motion(result):
        what = f"the mechanism cannot be drawn, because its run failed at the start: {result.outcome.name}"
        raise SceneError([Problem(where, what, result.outcome.advice)])
    return result


def _result(source: Scene | Result, time: float) -> Result:
    from trunnion.simulation.results.result import Result
    from trunnion.simulation.run import simulate

    if isinstance(source, Result):
        return source

    until = time if time > 0 else START_TIME * float(source.simulation.until)
    return simulate(source, until=until, every=until, outputs=needed(source))


def needed(scene: Scene) -> list[str]:
    """Patterns of the columns that a picture of this scene needs."""
    from trunnion.scene.queries.joint_contact_elements import touching

    rubbing = [touching(j) for j in scene.joints.values() if j.friction is not None]
    moves = any(REGISTRY[j.type].nv for j in scene.joints.values())
    touches = any(element is not None and element.count for element in rubbing)
    return [*NEEDED[:2], *(NEEDED[2:3] if moves else ()), *(NEEDED[3:4] if touches else ()), *(NEEDED[4:] if rubbing else ())]


def set_limits(axes: Axes, spots: np.ndarray, ratio: float = SIZE[0] / (0.89 * SIZE[1])) -> None:
    """Set the limits of the axes around all points, with equal scales and the picture's proportions."""
    low, high = spots.min(axis=0), spots.max(axis=0)
    middle = (low + high) / 2
    half = 0.62 * max(high[0] - low[0], ratio * (high[1] - low[1]), 1e-9)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half / ratio, middle[1] + half / ratio)


def _grid(axes: Axes, view: np.ndarray, scene: Scenery, seen: np.ndarray) -> None:
    """Draw horizontal ground lines below the mechanism, up to the picture's edges."""
    from matplotlib.collections import LineCollection

    up = scene.up
    a = view[0] - (view[0] @ up) * up
    a /= np.linalg.norm(a)
    b = np.cross(up, a)
    foot = np.array([seen[:, 0].mean(), seen[:, 1].min() - 0.06 * scene.size, 0.0]) @ view
    width = axes.get_xlim()[1] - axes.get_xlim()[0]
    step = min((k * 10.0 ** np.floor(np.log10(width)) for k in (0.1, 0.2, 0.5, 1.0)), key=lambda s: abs(s - width / 7))
    count = 48
    lines = []
    for along, across in ((a, b), (b, a)):
        center = foot - ((foot @ across) % step) * across
        for k in range(-count, count + 1):
            ends = np.array([center + k * step * across + s * count * step * along for s in (-1, 1)])
            lines.append((ends @ view.T)[:, :2])
    axes.add_collection(LineCollection(lines, colors=GRID, linewidths=0.6, zorder=0), autolim=False)


def draw_bodies(axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, row: int, opaque: float = 1.0) -> np.ndarray:
    """Draw bodies as polygons from back to front, then pins over the bodies. Returns the corners in the picture."""
    from matplotlib.collections import PolyCollection

    bodies: list[Polygon] = []
    pins: list[Polygon] = []
    for i, part in enumerate(scene.parts):
        bodies += _polygons(part.mesh, view, *moved.pose(i, row), part.color, (i % 4) * COPLANAR * scene.size)
    for j in scene.joints:
        for on, mesh in j.pins:
            pins += _polygons(mesh, view, *moved.pose(on, row), JOINT, 0.0)
    corners = [np.zeros((1, 2))] if not bodies and not pins else []
    for polygons, alpha, order in ((bodies, opaque, 1.0), (pins, 0.85 * opaque, 1.5)):
        polygons.sort(key=lambda s: s[0])
        shapes = [s[1] for s in polygons]
        fills, lines = [s[2] for s in polygons], [s[3] for s in polygons]
        drawn = PolyCollection(shapes, facecolors=fills, edgecolors=lines, linewidths=0.5, alpha=alpha, zorder=order)
        axes.add_collection(drawn, autolim=False)
        corners += shapes
    return np.concatenate(corners)


def _polygons(mesh: Mesh, view: np.ndarray, p: np.ndarray, r: np.ndarray, fill: str, bias: float) -> list[Polygon]:
    """The faces towards the viewer, and their edges. A face has an outline in its own colour, so that no seams are visible."""
    from matplotlib.colors import to_rgb

    spots = (mesh.vertices @ r.T + p) @ view.T
    rgb, out = np.array(to_rgb(fill)), []
    for face, edges in zip(mesh.faces, mesh.edges, strict=True):
        corners = spots[list(face)]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        if normal[2] <= 0:
            continue
        light = max(0.0, float(normal @ LIGHT) / float(np.linalg.norm(normal)))
        color = tuple(np.clip(rgb * (0.58 + 0.42 * light), 0, 1))
        depth = float(corners[:, 2].mean()) + bias
        out.append((depth, corners[:, :2], color, color))
        dark = tuple(0.45 * rgb)
        out += [(depth, corners[[k, (k + 1) % len(face)], :2], dark, dark) for k in range(len(face)) if edges & (1 << k)]
    return out


def _rails(axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, result: Result, row: int) -> None:
    for part, p, q in rails(result, scene):
        x, r = moved.pose(part, row)
        line = (np.array([p, q]) @ r.T + x) @ view.T
        axes.plot(line[:, 0], line[:, 1], "-.", color=JOINT, lw=0.8, zorder=0.9)


def _springs_and_rods(axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, row: int, seen: list[np.ndarray]) -> None:
    """Draw springs and dampers between points as zigzags, and rods as lines."""
    for k, ends in enumerate((*scene.springs, *scene.rods)):
        p, q = (((r @ point + x) @ view.T)[:2] for (x, r), point in ((moved.pose(part, row), point) for part, point in ends))
        if k >= len(scene.springs):
            line = np.array([p, q])
            axes.plot(line[:, 0], line[:, 1], "o-", color=INK, lw=2.2, ms=3.6, zorder=2)
            seen.append(line)
            continue
        across = np.array([p[1] - q[1], q[0] - p[0]]) / max(float(np.linalg.norm(q - p)), 1e-12)
        along = np.array([0.0, 0.15, *np.linspace(0.19, 0.81, COILS), 0.85, 1.0])[:, None]
        aside = np.array([0.0, 0.0, *(WIDTH * np.linalg.norm(q - p) * (-1.0) ** np.arange(COILS)), 0.0, 0.0])[:, None]
        line = p + along * (q - p) + aside * across
        axes.plot(line[:, 0], line[:, 1], color=INK, lw=1.1, zorder=2)
        seen.append(line)


def contact_places(scene: Scenery, moved: Motion, result: Result, row: int) -> list[tuple[str, np.ndarray, np.ndarray, float, int]]:
    """(columns, point, outward normal, normal force, friction state) of every closed contact, in the world's axes."""
    out = []
    for j in scene.joints:
        turn = moved.pose(j.parts[0], row)[1] @ j.frames[0]
        for c in j.contacts:
            names = [f"{c.columns}.normal[{k}]" for k in (1, 2, 3)]
            if not all(n in result for n in (*names, f"{c.columns}.normal_force")):
                continue
            force = float(result[f"{c.columns}.normal_force"][row])
            n = turn @ np.array([result[name][row] for name in names])
            x, r = moved.pose(c.part, row)
            state = round(float(result[c.state][row])) if c.state in result else 0
            if force > 0 and np.all(np.isfinite(n)):
                out.append((c.columns, x + r @ c.bases(result)[row] + c.arm * n, n, force, state))
    return out


def _contacts(
    axes: Axes, view: np.ndarray, scene: Scenery, moved: Motion, result: Result, row: int, seen: list[np.ndarray]
) -> set[int]:
    """Draw contacts as dots with arrows of the normal force on the pin. Returns the friction states that occur."""
    scale, states = arrow_scale(result, scene), set()
    for _, p, n, force, state in contact_places(scene, moved, result, row):
        tip, tail = p @ view.T, (p + n * force * scale) @ view.T
        axes.annotate("", xy=tip[:2], xytext=tail[:2], arrowprops=ARROW_LOOK, zorder=4)
        axes.plot(*tip[:2], "o", ms=5.5, color=STATES.get(state, OPEN)[0], mec="white", mew=0.7, zorder=5)
        seen.append(np.array([tip[:2], tail[:2]]))
        states.add(state)
    return states


def _arrow_legend(axes: Axes, scale: float, force: float) -> None:
    """Draw the scale of all arrows at the lower left. The scale is the arrow of a force that is a round number."""
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    x, y = x0 + 0.03 * (x1 - x0), y0 + 0.04 * (y1 - y0)
    axes.annotate("", xy=(x + force * scale, y), xytext=(x, y), arrowprops=ARROW_LOOK)
    axes.text(x, y + 0.015 * (y1 - y0), f"normal force on the pin: {force:g} N", size=8, color=ARROW, ha="left", va="bottom")


def _captions(fig: Figure, result: Result, row: int, states: set[int]) -> None:
    """Write title, time, and the meaning of the dots' colours."""
    title = result.scene.title or result.scene.name
    fig.text(0.03, 0.95, title, size=12, weight="bold", color=INK)
    fig.text(0.03, 0.91, f"t = {result.time[row]:.6g} s", size=9, color="#555555")
    for i, state in enumerate(sorted(states)):
        shade, words = STATES.get(state, OPEN)
        fig.text(0.97, 0.035 + 0.033 * i, f"● {words}", size=8, color=shade, ha="right")
