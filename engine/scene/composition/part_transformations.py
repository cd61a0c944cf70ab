"""Transformations of whole parts: rotation about x, y or z, reflection, translation. All transformations change the poses of
bodies; a reflection also changes the data in the body's frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.joints import REGISTRY, JointKind
from trunnion.scene.expressions.expression_arithmetic import Term, is_number, known, plus, three, times
from trunnion.scene.findings.findings_and_paths import Path
from trunnion.scene.queries import packed_surfaces
from trunnion.scene.units.unit_parser import UnitError

AXES = ("x", "y", "z")
PRODUCTS = ((0, 1), (0, 2), (1, 2))
"""Axes of the products of inertia, which are the fourth, fifth and sixth entry of ``inertia``."""
Note = tuple[Path, str, str]
"""(path in the part, mistake, remedy)."""

STILL = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@dataclass(frozen=True)
class Transformation:
    """x → matrix x + shift, for a whole part; entries are numbers or expressions. For a rotation, ``turn`` holds the axis and
    the angle. For a reflection, ``mirror`` is the index of the axis normal to the mirror plane; otherwise it is −1."""

    matrix: tuple[tuple[Term, ...], ...]
    shift: tuple[Term, ...] = (0, 0, 0)
    turn: tuple[str, Term] | None = None
    mirror: int = -1

    def direction(self, d: Sequence[Term], sign: float = 1.0) -> list[Term]:
        """The image of a direction, times ``sign``."""
        if self.matrix == STILL:
            return list(d)
        out = []
        for row in self.matrix:
            total: Term = 0.0
            for m, c in zip(row, d, strict=True):
                total = plus(total, times(m, c))
            out.append(times(sign, total))
        return out

    def place(self, p: Sequence[Term]) -> list[Term]:
        """The image of a point."""
        return [plus(c, s) for c, s in zip(self.direction(p), self.shift, strict=True)]

    @property
    def turns(self) -> bool:
        """Whether the transformation changes directions."""
        return self.turn is not None or self.mirror >= 0


def move_about(
    matrix: tuple[tuple[Term, ...], ...], through: Any, turn: tuple[str, Term] | None = None, mirror: int = -1
) -> Transformation:
    """A rotation or reflection whose axis or plane contains the point ``through``."""
    center = three(through)
    plain = Transformation(matrix)
    back = [times(-1.0, c) for c in plain.direction(center)]
    return Transformation(matrix, tuple(plus(c, b) for c, b in zip(center, back, strict=True)), turn, mirror)


def shift_by(step: Any) -> Transformation:
    """A translation by ``step``."""
    return Transformation(STILL, tuple(three(step)))


def move_part(data: dict[str, Any], moves: Sequence[Transformation]) -> tuple[dict[str, Any], list[Note]]:
    """(the transformed part, notes about data that cannot be transformed). Raises UnitError when a point does not have three
    entries."""
    notes: list[Note] = []
    for move in moves:
        for key, change in (("bodies", _move_body), ("joints", _move_joint), ("forces", _move_force)):
            _change_section(data, key, change, move, notes)
        ground = data.get("ground")
        if isinstance(ground, dict):
            _change_section(ground, "points", _move_point, move, notes)
    return data, list(dict.fromkeys(notes))


Change = Callable[[str, Any, Transformation, list[Note]], Any]


def _change_section(data: dict[str, Any], key: str, change: Change, move: Transformation, notes: list[Note]) -> None:
    group = data.get(key)
    if isinstance(group, dict):
        wanted = list if change is _move_point else dict
        data[key] = {n: change(n, v, move, notes) if isinstance(v, wanted) else v for n, v in group.items()}


def _move_point(name: str, p: Any, move: Transformation, notes: list[Note]) -> Any:
    return move.place(three(p))


def _mirror_vector(p: Any, k: int) -> Any:
    """A point or direction in the frame of a body that is reflected along its axis k (−1: not reflected); other values stay
    unchanged."""
    return [times(-1.0, c) if i == k else c for i, c in enumerate(p)] if isinstance(p, list) and len(p) == 3 else p


def _move_start(path: Path, p: Any, move: Transformation, notes: list[Note]) -> Any:
    """The transformed start position of a point. If a transformation turns directions, all components of the position must be
    given."""
    is_open = [c is None for c in p] if isinstance(p, list) else []
    if any(is_open) and move.turns:
        notes.append((path, "a start position with an open component cannot be turned or mirrored", "give all three components"))
        return p
    moved = move.place(three([0.0 if c is None else c for c in p] if is_open else p))
    return [None if o else c for o, c in zip(is_open, moved, strict=True)] if is_open else moved


def _move_body(name: str, b: Any, move: Transformation, notes: list[Note]) -> Any:
    out = dict(b)
    if isinstance(out.get("start"), dict):
        out["start"] = {n: _move_start(("bodies", name, "start", n), p, move, notes) for n, p in out["start"].items()}
    if out.get("position") is None:
        if move.turns:
            notes.append((("bodies", name), "only placed bodies can be turned or mirrored", "give it a position"))
        return out
    out["position"] = move.place(three(out["position"]))
    given = out.get("orientation")
    turns = given if isinstance(given, list) else [] if given is None else [given]
    if move.turn is not None:
        out["orientation"] = [*turns, {"axis": move.turn[0], "angle": move.turn[1]}]
    if move.mirror < 0:
        return out
    k = move.mirror
    if turns:
        mirrored = [_mirror_turn(t, k) for t in turns]
        out["orientation"] = mirrored if isinstance(given, list) else mirrored[0]
    if isinstance(out.get("points"), dict):
        out["points"] = {n: _mirror_vector(p, k) for n, p in out["points"].items()}
    if "center" in out:
        out["center"] = _mirror_vector(out["center"], k)
    if isinstance(out.get("surface"), str):
        with suppress(ValueError):  # the checks report an invalid surface
            out["surface"] = packed_surfaces.mirrored(out["surface"], k)
    if isinstance(out.get("inertia"), dict) and "axis" in out["inertia"]:
        out["inertia"] = {**out["inertia"], "axis": _mirror_vector(out["inertia"]["axis"], k)}
    if isinstance(out.get("inertia"), list) and len(out["inertia"]) == 6:
        six = out["inertia"]
        out["inertia"] = [times(-1.0, v) if i > 2 and k in PRODUCTS[i - 3] else v for i, v in enumerate(six)]
    return out


def _mirror_turn(t: Any, k: int) -> Any:
    """The mirror image of a turn. A turn by an angle becomes a turn about the mirrored axis by the opposite angle. In a turn with
    ``towards``, both directions are mirrored."""
    if not isinstance(t, dict):
        return t
    if "towards" in t:
        return {**t, "axis": _mirror_direction(t.get("axis"), k, 1.0), "towards": _mirror_vector(t["towards"], k)}
    return {**t, "axis": _mirror_direction(t.get("axis"), k, -1.0)}


def _mirror_direction(axis: Any, k: int, sign: float) -> Any:
    """A direction reflected along axis k, times ``sign``."""
    vector = axis_vector(axis) if isinstance(axis, str) else axis
    if not isinstance(vector, list) or len(vector) != 3:
        return axis
    return axis_name([times(sign, c) for c in _mirror_vector(vector, k)])


def axis_vector(axis: str) -> Any:
    """The three components of a named axis; other text stays unchanged."""
    letter, sign = axis[-1:], -1.0 if axis[:1] == "-" else 1.0
    return [sign if a == letter else 0.0 for a in AXES] if letter in AXES and len(axis) < 3 else axis


def axis_name(vector: list[Term]) -> Any:
    """The name of the axis that equals the direction; a direction along no axis stays unchanged."""
    if all(is_number(c) for c in vector) and sorted(abs(c) for c in vector) == [0, 0, 1]:
        k = next(i for i, c in enumerate(vector) if c)
        return ("-" if vector[k] < 0 else "") + AXES[k]
    return vector


def _move_joint(name: str, j: Any, move: Transformation, notes: list[Note]) -> Any:
    out, kind = dict(j), REGISTRY.get(str(j.get("type")))
    if isinstance(out.get("at"), list):
        out["at"] = move.place(three(out["at"]))
    sign = 1.0
    if move.mirror >= 0 and kind is not None:
        sign = _mirror_sign(name, out, kind, notes)
        _mirror_profiles(out, sign)
    if move.turns:
        across = kind is not None and (kind.second_axis >= 0 or (out.get("friction") is not None and kind.slides_along >= 0))
        if kind is not None and kind.nv not in (0, 6):
            _write_frames(("joints", name), out, across, notes)
        _turn_frame(out, move, sign)
    for side in ("inboard", "outboard"):
        given = out.get(side)
        if not isinstance(given, dict):
            continue
        given = dict(given)
        on_ground = given.get("body") == "ground"
        if isinstance(given.get("point"), list):
            given["point"] = move.place(three(given["point"])) if on_ground else _mirror_vector(given["point"], move.mirror)
        if on_ground and move.turns:
            _turn_frame(given, move, sign)
        elif move.mirror >= 0:
            for key in {"axis", "reference"} & given.keys():
                given[key] = _mirror_direction(given[key], move.mirror, sign)
        out[side] = given
    return out


def _write_frames(path: Path, j: dict[str, Any], across: bool, notes: list[Note]) -> None:
    """Write the default axis and reference of a joint into its data, and the default reference of each side that has its own
    axis."""
    if "reference" in j:
        return
    own = [key for key in ("inboard", "outboard") if isinstance(j.get(key), dict) and "axis" in j[key]]
    for key in own:
        j[key] = dict(j[key])
        _write_frame(path, j[key], across, notes)
    if len(own) < 2:
        _write_frame(path, j, across, notes)


def _write_frame(path: Path, j: dict[str, Any], across: bool, notes: list[Note]) -> None:
    """Write the default axis and reference of a joint, of its side or of a bushing into its data, so that axis and reference can be
    rotated. across: whether the directions normal to the axis matter."""
    if "reference" in j:
        return
    if "axis" not in j:
        j["axis"], j["reference"] = "x", "y"
        return
    vector = axis_vector(j["axis"]) if isinstance(j["axis"], str) else j["axis"]
    try:
        sizes = [abs(known(c)) for c in three(vector)]
    except UnitError:
        if across:
            what = "the directions normal to its axis must turn with the assembly"
            notes.append((path, what, "give it a reference"))
        return
    j["reference"] = AXES[(sizes.index(max(sizes)) + 1) % 3]


def _turn_frame(owner: dict[str, Any], move: Transformation, sign: float) -> None:
    for key in ("axis", "reference"):
        d = owner.get(key)
        vector = axis_vector(d) if isinstance(d, str) else d
        if isinstance(vector, list) and len(vector) == 3:
            owner[key] = axis_name(move.direction(vector, sign=sign))


def _mirror_sign(name: str, j: dict[str, Any], kind: JointKind, notes: list[Note]) -> float:
    """The sign of a joint's mirrored frame for which the joint's numbers stay the same: −1 for rotations, 1 for travels. A joint
    with rotations and travels has a mirror image only if it has no numbers along its freedoms."""
    turns = [kind.turns(k) for k in range(kind.nv)]
    if j.get("lead_angle") is not None:
        j["lead_angle"] = times(-1.0, j["lead_angle"])
    if kind.pitched and "pitch" in j:
        j["pitch"] = times(-1.0, j["pitch"])
        return -1.0
    if len(set(turns)) > 1:
        devices = ("spring", "nonlinear", "end_stops", "drive", "effort", "motor", "latch")
        said = [k for k in ("start", *devices) if j.get(k) is not None]
        for k in said:
            what = f"{k} of a {kind.name} joint has no mirror image: it keeps the sign of travels, but changes the sign of angles"
            notes.append((("joints", name, k), what, "write the joint for each side"))
    return -1.0 if turns and all(turns) else 1.0


def _mirror_profiles(j: dict[str, Any], sign: float) -> None:
    """Mirror a joint's curve and profile, both in its e2-e3 plane. In the new frame e2 becomes sign · e2, and e3 becomes −e3."""
    curve, profile = j.get("curve"), j.get("profile")
    if isinstance(curve, dict) and isinstance(curve.get("points"), list):
        pairs = [p if not isinstance(p, list) or len(p) != 2 else [times(sign, p[0]), times(-1.0, p[1])] for p in curve["points"]]
        j["curve"] = {**curve, "points": pairs}
    if isinstance(profile, dict) and isinstance(profile.get("angle"), list) and isinstance(profile.get("radius"), list):
        if sign > 0:  # an angle φ of the profile becomes −φ
            angles, radii = [times(-1.0, a) for a in reversed(profile["angle"])], profile["radius"][::-1]
        else:  # an angle φ of the profile becomes φ + π
            angles, radii = [plus(math.pi, a) for a in profile["angle"]], profile["radius"]
        j["profile"] = {**profile, "angle": angles, "radius": radii}


def _move_force(name: str, f: Any, move: Transformation, notes: list[Note]) -> Any:
    out = dict(f)
    if out.get("type") == "bushing" and move.turns:
        _write_frame(("forces", name), out, True, notes)
        _turn_frame(out, move, 1.0)
        return out
    for key, sign in (("force", 1.0), ("torque", -1.0 if move.mirror >= 0 else 1.0)):
        given = out.get(key)
        if not isinstance(given, list) or len(given) != 3 or not move.turns:
            continue
        in_body = out.get("frame") == "body"
        if in_body and move.mirror < 0:
            continue
        if any(isinstance(c, dict) for c in given):
            what = "a load that varies with time or by an input cannot be turned"
            notes.append((("forces", name, key), what, "give it frame: body, or write it for each copy"))
            continue
        out[key] = [times(sign, c) for c in _mirror_vector(given, move.mirror)] if in_body else move.direction(given, sign)
    return out
