"""From the tape of a function to those of its derivatives: ``point`` computes all values and what tangents keep of them, ``along``
follows four directions at once (METHOD, "Jacobians on parts").

Each number that a direction may change has a vector of four beside it. They lie in *cells*, runs of numbers that calls use
together; a call none of whose cells a direction has reached is passed over when the tape is walked, and what it would write is
zero."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from engine.parts.known import AROUND, KEPT, Part
from engine.parts.store import tangents
from engine.parts.tables import Tables
from engine.parts.tape import BUILTINS, Block, Builtin, Space, Tape

BODIES = "p_"
"""Begins the names of functions of which only values are needed: tangents of what they find are found otherwise."""
LONGEST = 36
"""Numbers that such a function reads behind each other at most."""
B = Builtin


@dataclass
class Call:
    """A call of the tape ``along``. places: where numbers are, or (True) the vectors beside them, None where these are zeros; ins,
    outs: what it reads and writes of vectors, ``added``: that is added to."""

    function: int
    places: list[tuple[Block | None, bool]]
    numbers: list[int]
    ins: list[Block]
    outs: list[Block]
    added: list[Block]


@dataclass
class Given:
    """A call of a tape, its places with their lengths. outs: those it writes; added: those it adds to."""

    function: int
    names: tuple[str, ...]
    places: dict[str, Block]
    outs: set[str]
    added: set[str]
    numbers: list[int]
    read: list[Block] = field(default_factory=list)
    """Places whose values tangents read."""


def _builtin(which: int, numbers: Sequence[int]) -> tuple[dict[str, int], set[str], set[str]]:
    """Lengths of the places of a function of the machine, those that it writes, and those that it adds to."""
    n, k = numbers[0], numbers[1] if len(numbers) > 1 else 0
    span = (k - 1) * numbers[2] if which in (B.DOTS, B.SPREAD) and k else 0
    return {
        B.ZERO: ({"out": n}, {"out"}, set()),
        B.COPY: ({"a": n, "out": n}, {"out"}, set()),
        B.ADD: ({"a": n, "out": n}, {"out"}, {"out"}),
        B.GATHER: ({"a": max([*numbers[1:], -1]) + 1, "constants": 0, "out": n}, {"out"}, set()),
        B.PICK: ({"a": max(numbers[1:], default=-1) + 1, "out": n}, {"out"}, set()),
        B.SCALE: ({"a": n, "b": 1, "out": n}, {"out"}, set()),
        B.PRODUCT: ({"a": n, "b": n, "out": 1}, {"out"}, {"out"}),
        B.DOTS: ({"a": span + n, "b": n, "out": (k - 1) * numbers[3] + 1 if which == B.DOTS else 0}, {"out"}, {"out"}),
        B.ALONG: ({"a": n * k, "b": k, "out": n}, {"out"}, {"out"}),
        B.PIECE: ({"a": 1, "b": 0, "out": 5}, {"out"}, set()),
        B.FOOT: ({"a": 2, "b": 0, "out": 11}, {"out"}, set()),
        B.SPREAD: ({"a": span + n, "b": k, "out": n}, {"out"}, {"out"}),
    }[Builtin(which)]


class Marks:
    """Which numbers of which arrays something holds of."""

    def __init__(self) -> None:
        self.of: dict[Space, bytearray] = {}

    def add(self, b: Block) -> None:
        """It holds of these."""
        own = self.of.setdefault(b.space, bytearray())
        if len(own) < b.at + b.size:
            own.extend(bytes(b.at + b.size - len(own)))
        own[b.at : b.at + b.size] = b"\1" * b.size

    def __contains__(self, b: Block) -> bool:
        """Whether it holds of any of these."""
        return 1 in self.of.get(b.space, b"")[b.at : b.at + b.size]


@dataclass
class Directions:
    """Tapes being derived. scene: whose parts are called; scratch: among whose numbers what is kept lies; seeded: what directions
    are given for; numbers: along parameters, too."""

    scene: Tables
    scratch: Tape
    seeded: Sequence[Block]
    numbers: bool = False
    values: list[Given] = field(default_factory=list)
    kept: list[Given] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)
    active: Marks = field(default_factory=Marks)

    def __post_init__(self) -> None:
        self._prepared = 0
        self._names: list[str] = []
        self._tangents: dict[tuple[str, bool], Part] = {}
        for b in self.seeded:
            self.active.add(b)

    # -- calls --------------------------------------------------------------------------------------------------------------

    def follow(self, tape: Tape, first: int = 0) -> int:
        """Derive the calls of a tape from ``first`` on, after what parameters have become by then; where it ends."""
        if self.numbers and tape is not self.scene.prepare:
            self._prepared = self.follow(self.scene.prepare, self._prepared)
        code, at = tape.code, first
        while at < len(code):
            function, count, more = code[at : at + 3]
            where = code[at + 3 : at + 3 + 2 * count]
            numbers = code[at + 3 + 2 * count : at + 3 + 2 * count + more]
            at += 3 + 2 * count + more
            g = self._given(function, where, numbers)
            if tape is not self.scene.prepare:
                self.values.append(g)
            self._derive(g)
        return at

    def _name(self, function: int) -> str:
        """Of a part's function, by its number."""
        while len(self._names) <= function - BUILTINS:
            self._names = list(self.scene.functions)
        return self._names[function - BUILTINS]

    def _tangent(self, name: str, numbers: bool = False) -> Part:
        asked = name, self.numbers or numbers
        if asked not in self._tangents:
            self._tangents[asked] = tangents.tangent(*self.scene.part_of[name].made, asked[1])
        return self._tangents[asked]

    def _given(self, function: int, where: list[int], numbers: list[int]) -> Given:
        if function < BUILTINS:
            sizes, outs, added = _builtin(function, numbers)
            names: tuple[str, ...] = tuple(sizes)
        else:
            name = self._name(function)
            names = self.scene.part_of[name].places[name]
            if name.startswith(BODIES):
                sizes, outs, added = dict.fromkeys(names, LONGEST), set(), set()
            else:
                sizes = dict(self._tangent(name).sizes)
                outs = {n for n in names if f"out {n}" in sizes}
                added = {n for n in names if f"added {n}" in sizes}
        places = {n: Block(Space(where[2 * i]), where[2 * i + 1], sizes[n]) for i, n in enumerate(names)}
        return Given(function, names, places, outs, added, numbers)

    def _derive(self, g: Given) -> None:
        if g.function < BUILTINS:
            self._derive_builtin(g)
        elif g.outs:
            self._derive_part(g)

    def _derive_part(self, g: Given) -> None:
        numbers = g.places.get("numbers")
        part = self._tangent(self._name(g.function), numbers is not None and numbers in self.active)  # some follow time
        at, along = part.places
        moving = [n for n in g.names if n not in g.outs and g.places[n] in self.active]
        if not moving:
            return self._still(g)
        places = dict(g.places)
        if part.sizes[KEPT]:
            places[KEPT] = self.scratch.scratch_block(part.sizes[KEPT])
            function = self.scene.function(part, at)
            names = part.places[at]
            self.kept.append(Given(function, names, {n: places[n] for n in names}, {KEPT}, set(), []))
        names = part.places[along]
        g.read = [p for n, p in places.items() if n not in g.outs and n in {*part.places[at], *names}]
        spots: list[tuple[Block | None, bool]] = []
        for n in names:
            name = n.removeprefix(AROUND)
            zero = name != n and name not in g.outs and name not in moving
            spots.append((None if zero else places[name], name != n))
        outs = [n for n in g.outs if AROUND + n in names]
        ins = [n for n in moving if AROUND + n in names]
        if not ins:
            return self._still(g)
        self._call(self.scene.function(part, along), spots, [], [places[n] for n in ins],
                   [places[n] for n in outs if n not in g.added], [places[n] for n in outs if n in g.added])  # fmt: skip
        return None

    def _still(self, g: Given) -> None:
        """A call whose values no direction changes: the vectors of what it writes are zeros, if they are ever anything else."""
        outs = [g.places[n] for n in g.outs if n not in g.added]
        if outs:
            self.calls.append(Call(B.COPY, [], [], [], outs, []))

    def _call(self, function: int, spots: list[tuple[Block | None, bool]], numbers: list[int], ins: list[Block], outs: list[Block],
              added: list[Block]) -> None:  # fmt: skip
        self.calls.append(Call(function, spots, numbers, ins, outs, added))
        for b in [*outs, *added]:
            self.active.add(b)

    def _derive_builtin(self, g: Given) -> None:
        a, b, out = (g.places.get(n) for n in ("a", "b", "out"))
        assert out is not None
        if not out.size:  # products of no rows: a joint that forbids nothing
            return None
        ins = [x for x in (a, b) if x is not None and x in self.active]
        if not ins or g.function in (B.PIECE, B.FOOT):  # which piece is in force does not change a curve to first order
            return self._still(g)
        added = [out] if g.added else []
        outs = [] if added else [out]
        if g.function in (B.COPY, B.ADD):
            self._call(g.function, [(a, True), (out, True)], g.numbers, ins, outs, added)
            return None
        both = [(a, False), (b, False)] if b is not None else []
        g.read = [x for x, _ in both if x is not None]
        spots = [*both, *[(x if x in ins else None, True) for x in (a, b) if x], (out, True)]
        name = f"tr_v_{Builtin(g.function).name.lower()}"
        numbers = g.numbers
        if g.function == B.ALONG:
            name, numbers = "tr_v_spread", [*g.numbers[:2], g.numbers[0]]
        self._call(self.scene.own_function(name), spots, numbers, ins, outs, added)
        return None

    def linear(self, function: int, places: Sequence[tuple[Block, bool]], ins: Iterable[Block], outs: Iterable[Block],
               added: Iterable[Block] = (), numbers: Sequence[int] = ()) -> None:  # fmt: skip
        """A call of a function of vectors, which has no values."""
        outs, added = [b for b in outs if b.size], [b for b in added if b.size]
        ins = [b for b in ins if b.size and b in self.active]
        spots = [(b if not v or b in self.active or b in [*outs, *added] else None, v) for b, v in places]
        if ins:
            self._call(function, spots, list(numbers), ins, outs, added)

    # -- tapes --------------------------------------------------------------------------------------------------------------

    def point(self, tape: Tape, outs: Iterable[Block] = ()) -> None:
        """Write all calls that find values which tangents need, or that are asked for (``outs``), in their order, then what
        tangents keep."""
        needed, later, live = Marks(), Marks(), []
        for b in outs:
            needed.add(b)
        for g in reversed(self.values):
            assert not any(b in later for b in g.read), "what a tangent reads is written again"
            for b in g.read:
                needed.add(b)
            body = g.function >= BUILTINS and not g.outs
            if body or any(g.places[n] in needed for n in g.outs):
                live.append(g)
                for n, b in g.places.items():
                    if n not in g.outs:
                        needed.add(b)
            for n in g.outs:
                later.add(g.places[n])
        for g in [*reversed(live), *self.kept]:
            tape.call(g.function, [g.places[n] for n in g.names], g.numbers)
