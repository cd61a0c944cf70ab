"""What is asked of the admissible states: for every pair its intervals, for every load its breakaway, for all whether they hold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from engine.bounds.effort import Effort
from engine.bounds.limits import Stress, beginning, stressed
from engine.bounds.motions import Motion, motions
from engine.bounds.narrow import capped, first_cell
from engine.bounds.program import Program, Row
from engine.bounds.reach import reached
from engine.bounds.relaxed import Cell, Relaxation
from engine.bounds.report import Breakaway, End, Interval, JointState, LoadBounds, PairBounds, State
from engine.bounds.search import Found, least
from engine.bounds.space import Space, holding, space
from engine.bounds.statics import Statics

NEVER = 1e-7
"""A freedom that nothing holds is out of balance by more than this part of the loads; round-off is 1e-12."""

FIRST = 0.2
"""Part of the time left that may go into the first cones, which every search of these states begins with."""


@dataclass(frozen=True)
class Asked:
    """A space with its program, and for each pair the term of its friction and what it holds by sense of friction. effort: what
    searches may cost; root: the cell it begins with; there: whether there is any state (None: not found out)."""

    space: Space
    program: Program
    sizes: list[int]
    holds: list[dict[int, dict[int, float]]]
    effort: Effort
    root: Cell
    there: bool | None

    @property
    def none(self) -> np.ndarray:
        """A row of nothing."""
        return np.zeros(self.space.open + 1)


def asked(st: Statics, pairs: tuple, self_stress: Stress | None, effort: Effort, load: int | None = None) -> Asked:
    """The admissible states with all loads as they are, but for the one named."""
    s = space(st, pairs, load)
    program, sizes, holds = holding(s)
    stress: dict[int, float] = {}
    if self_stress is not None:
        program, stress = stressed(s, program, self_stress)
    none, root = Row(np.zeros(s.open + 1)), Cell()
    if s.misses > NEVER:
        return Asked(s, program, sizes, holds, effort, root, False)
    reach = reached(program, sizes, holds, stress)
    if reach:
        effort.begin(FIRST)
        program = capped(program.asking(none, reach), effort)
        answer = Relaxation(program, effort.over).solve({})
        if answer is None:
            return Asked(s, program, sizes, holds, effort, root, False)
        root = first_cell(program, answer.X, effort)
    found = least(program.asking(none), effort, root=root)
    if found.X is None:
        return Asked(s, program, sizes, holds, effort, root, False if found.bound == np.inf else None)
    if not reach:
        effort.begin(FIRST)
        program = capped(program, effort)
        root = first_cell(program, found.X, effort)
    return Asked(s, program, sizes, holds, effort, root, True)


def state_of(a: Asked, X: np.ndarray, endless: bool) -> State:
    """The state at X, or the direction in which it lies."""
    s, st = a.space, a.space.statics
    x = s.basis @ X[:-1] / max(float(np.abs(X[:-1]).max(initial=0.0)), 1e-300) if endless else s.x(X)
    N = s.reactions(x) - (s.reactions(np.zeros_like(x)) if endless else 0.0)
    eta = x[st.eta0 : st.multipliers]
    held = st.probe.capacities(N, eta)
    joints = {}
    for j in st.joints:
        pairs = [slider.flag for slider in j.element.friction.sliders]
        shares = tuple(float(held[f, 1] / held[f, 0]) if held[f, 0] > 0.0 else 0.0 for f in pairs)
        reaction = dict(zip(j.rubs.needs, N[j.reactions].tolist(), strict=True))
        joints[j.rubs.joint] = JointState(reaction, tuple(float(eta[k]) for k in j.rubs.eta), shares)
    drives = {d.name: float(x[st.multipliers + k]) for k, d in enumerate(st.drives)}
    loads = {} if s.load is None else {st.loads[s.load].name: float(x[-1])}
    return State(joints, drives, loads, endless)


def end(a: Asked, found: Found, sign: float, scale: float) -> End:
    """An end of an interval from a search for the least of sign · quantity."""
    if found.X is None:
        return End(None, float(sign * found.bound * scale), None, found.cells)
    state = state_of(a, found.X / found.X[-1] if found.X[-1] > 0.0 else found.X, found.endless or found.X[-1] <= 0.0)
    if found.endless:
        return End(-sign * np.inf, -sign * np.inf, state, found.cells)
    return End(float(sign * found.value * scale), float(sign * found.bound * scale), state, found.cells)


def interval(a: Asked, row: Row, scale: float, normal: Row | None = None, floor: float = -np.inf) -> Interval:
    """Least and largest value of a row, times scale. floor: what the least cannot be less than."""
    ends = []
    for sign in (1.0, -1.0):
        objective = Row(sign * row.linear, {j: sign * c for j, c in row.norms.items()})
        found = least(a.program.asking(objective, normal=normal), a.effort, floor if sign > 0 else -np.inf, a.root)
        ends.append(end(a, found, sign, scale))
    return Interval(*ends)


def pair_bounds(a: Asked, i: int) -> PairBounds:
    """The intervals of a pair."""
    pair, made, size = a.space.pairs[i], a.holds[i], a.sizes[i]
    sense = _senses(a, i)
    normal = [
        interval(b, Row(a.none, {j: w / pair.static for j, w in made[k].items()}), a.space.scale, floor=0.0) for k, b in sense
    ]
    share = [interval(b, Row(a.none, {size: 1.0}), 1.0, Row(a.none, made[k]), 0.0) for k, b in sense]
    friction = interval(a, Row(a.program.terms[size][0]) if len(pair.eta) == 1 else Row(a.none, {size: 1.0}), a.space.scale)
    kind = a.space.statics.joint(pair.joint).element.joint.kind_name
    return PairBounds(pair.joint, pair.part, kind, _both(normal), friction, _both(share), all(c.exact for c in pair.capacities))


def _senses(a: Asked, i: int) -> list[tuple[int, Asked]]:
    """The senses of a pair's friction for which what it holds differs, each with the states of that sense."""
    made, size = a.holds[i], a.sizes[i]
    if list(made) == [0]:
        return [(0, a)]
    V = a.program.terms[size][0]
    return [(k, replace(a, program=a.program.asking(a.program.objective, (Row(-k * V),)))) for k in made]


def _both(found: list[Interval]) -> Interval:
    """The interval that holds several."""
    there = [i for i in found if i.least.certified < np.inf and i.largest.certified > -np.inf] or found
    low = min(there, key=lambda i: i.least.value if i.least.value is not None else np.inf)
    high = max(there, key=lambda i: i.largest.value if i.largest.value is not None else -np.inf)
    bounds = min(i.least.certified for i in there), max(i.largest.certified for i in there)
    return Interval(
        End(low.least.value, bounds[0], low.least.state, low.least.cells),
        End(high.largest.value, bounds[1], high.largest.state, high.largest.cells),
    )


def feasible(a: Asked, program: Program) -> bool | None:
    """Whether the program has a state; None where the cells were spent without an answer."""
    found = least(program.asking(Row(a.none)), a.effort, root=a.root)
    return True if found.X is not None else False if found.bound == np.inf else None


def begins(a: Asked, every: list[Motion]) -> list[tuple[Motion, bool | None]]:
    """The motions that some admissible state lets begin, in either sense; None where that was not found out."""
    out = []
    for m in every:
        answers = [feasible(a, beginning(a.space, a.program, m, s)) for s in (1.0, -1.0)]
        if any(x is not False for x in answers):
            out.append((m, True if True in answers else None))
    return out


def load_bounds(st: Statics, pairs: tuple, self_stress: Stress | None, effort: Effort, k: int, drive: bool) -> LoadBounds:
    """What a load, or the effort of a drive, can be before something lets go."""
    load = (st.drives if drive else st.loads)[k]
    a = asked(st, pairs, self_stress, effort, None if drive else k)
    amount = a.space.amount(st.multipliers + k if drive else len(a.space.origin) - 1)
    found, _, _ = motions(st, pairs, k if drive else None)
    ways = []
    for sign in (1.0, -1.0):
        possible = end(a, least(a.program.asking(Row(-sign * amount)), effort, root=a.root), -sign, a.space.scale)
        rows = () if drive else (Row(_from(sign, amount, load.now / a.space.scale)),)
        ends = []
        for m, sense in _ways(st, found, k, sign, drive):
            program = beginning(a.space, a.program, m, sense).asking(Row(sign * amount), rows)
            ends.append((end(a, least(program, effort, root=a.root), sign, a.space.scale), m))
        ways.append(_breakaway(pairs, possible, ends, sign))
    low, high = ways[1].possible.certified, ways[0].possible.certified
    if not drive and not low <= load.now <= high:  # nothing holds it as it is: nothing is sure
        ways = [replace(w, guaranteed=End(None, float("nan"), None, 0)) for w in ways]
    return LoadBounds(load.name, load.unit, None if drive else load.now, *ways)


def _from(sign: float, amount: np.ndarray, now: float) -> np.ndarray:
    """sign · (now − amount) ≤ 0: what the load is, or more of it."""
    out = -sign * amount
    out[-1] += sign * now
    return out


def _ways(st: Statics, found: list[Motion], k: int, sign: float, drive: bool) -> list[tuple[Motion, float]]:
    """Motions and senses that a load may begin: of a drive those it goes along with; of others all, since a load may also press
    less where friction holds."""
    if not drive:
        return [(m, s) for m in found for s in (1.0, -1.0)]
    out = []
    for m in found:
        rates = st.driven[k] @ m.rates
        if float(np.abs(rates).max()) > 1e-9 * float(np.abs(m.rates).max()):
            out.append((m, sign if rates[0] > 0.0 else -sign))
    return out


def _breakaway(pairs: tuple, possible: End, ends: list[tuple[End, Motion]], sign: float) -> Breakaway:
    """The first motion to begin, and how far the load is certain to be held."""
    there = [(e, m) for e, m in ends if e.value is not None or e.certified != sign * np.inf]
    if not there:
        return Breakaway(End(None, possible.certified, None, sum(e.cells for e, _ in ends)), possible, ())
    first, motion = min(there, key=lambda em: sign * (em[0].certified if em[0].value is None else em[0].value))
    certified = sign * min(sign * possible.certified, *(sign * e.certified for e, _ in there))
    joints = tuple(dict.fromkeys(pairs[i].joint for i in motion.moving))
    return Breakaway(End(first.value, certified, first.state, first.cells), possible, joints)
