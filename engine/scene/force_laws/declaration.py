"""Declaration of a law of a nonlinear spring or damper: its keys in a scene, its numbers, its force and energy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

from trunnion.basics.lazy_casadi import SX
from trunnion.basics.monotone_curves import KNOTS, filled
from trunnion.scene.findings.findings_and_paths import Finding, Path


class ForceLaw:
    """A force that depends on a coordinate x or on its rate: along a freedom of a joint, or along the line between two points (x is
    then their distance). The force is positive if it acts against x, or pulls the points together.

    key        the law's key in a scene; ``text`` describes it.
    data       type of the key's value; None if no key gives the law.
    units      unit of each number, by the last word of its path. In a unit, {x} and {f} stand for the units of x and of the force.
    count      number of leaves (numbers that are constants or parameters).
    elastic    whether the force depends on x alone. If so, the work of the force is stored; otherwise the work is lost.
    pieces     whether the law has pieces that a step must not jump over (``passed``)."""

    key: ClassVar[str]
    data: ClassVar[Any]
    text: ClassVar[str]
    units: ClassVar[Mapping[str, str]]
    count: ClassVar[int]
    elastic: ClassVar[bool]
    pieces: ClassVar[bool] = False

    def numbers(self, data: Any) -> Sequence[tuple[str, float]]:
        """(path below the key, value) of each leaf."""
        raise NotImplementedError

    def force(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        """The force, from the leaves n."""
        raise NotImplementedError

    def stored(self, n: Sequence[SX], x: SX) -> SX:
        """Energy of an elastic law. The derivative of the energy by x is the force."""
        raise NotImplementedError

    def passed(self, n: Sequence[SX], x: SX, rate: SX) -> SX:
        """Position in the law's curve, measured in pieces. Steps with error control change this position by at most half a
        piece."""
        raise NotImplementedError

    def findings(self, path: Path, data: Any) -> Iterator[Finding]:
        """Mistakes in the keys. path: path of the law."""
        yield from ()

    def unit(self, key: str, x: str, f: str) -> str:
        """Unit of a number. x, f: units of the coordinate and of the force."""
        return self.units[key].format(x=x, f=f)


def points(keys: tuple[str, str], data: Any) -> list[tuple[str, float]]:
    """The leaves of a curve: ``KNOTS`` abscissae, then as many forces. The last point fills the unused leaves."""
    each = ([(f".{key}[{i + 1}]", v) for i, v in enumerate(getattr(data, key))] for key in keys)
    return [leaf for leaves in each for leaf in filled(leaves)]


def faults_of_points(path: Path, key: str, at: Sequence[float], values: Sequence[float]) -> Iterator[Finding]:
    """Mistakes in the points of a curve: their number, and their order."""
    if len(at) != len(values):
        yield Finding((*path, "effort"), f"{len(at)} entries of {key} but {len(values)} of effort", f"give one for each {key}")
    if not 2 <= len(at) <= KNOTS:
        yield Finding((*path, key), f"a curve has 2 to {KNOTS} points, not {len(at)}", "remove some points" if len(at) > 2 else "")
    for i in range(1, len(at)):
        if not at[i - 1] < at[i]:
            what = f"the entries must increase: {at[i]:g} follows {at[i - 1]:g}"
            yield Finding((*path, key, i), what, "sort the points, and give each position one effort")
            break
