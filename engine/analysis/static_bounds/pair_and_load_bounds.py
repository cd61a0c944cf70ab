"""Results over all admissible states: intervals of every pair, breakaway of every load, motions that can begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.analysis.static_bounds.bounds_results import Breakaway, End, Interval, JointState, LoadBounds, PairBounds, State
from trunnion.analysis.static_bounds.branch_and_bound import Found, minimise
from trunnion.analysis.static_bounds.domain_reduction import first_cell, limit_norms
from trunnion.analysis.static_bounds.elementary_motions import Motion, motions
from trunnion.analysis.static_bounds.equilibrium_equations import Statics
from trunnion.analysis.static_bounds.equilibrium_space import Space, holding_program, space
from trunnion.analysis.static_bounds.linear_relaxation import FEASIBLE, Cell, Relaxation
from trunnion.analysis.static_bounds.norm_upper_bounds import norm_bounds
from trunnion.analysis.static_bounds.search_budget import SearchBudget
from trunnion.analysis.static_bounds.slip_onset_and_self_stress import Stress, limit_self_stress, restrict_to_onset
from trunnion.analysis.static_bounds.sum_of_norms_program import Program, Row, term_index
from trunnion.basics.lazy_data_classes import dataclass
from trunnion.elements.contact.static_friction_capacity import Capacity, Norm, Pair

NEVER = 1e-7
"""A freedom without friction moves if its force imbalance, relative to the loads, exceeds this value (round-off is 1e-12)."""

FIRST = 0.2
"""Fraction of the remaining time for computing the first cones, with which every search over the admissible states begins."""


@dataclass(frozen=True)
class AdmissibleStates:
    """All states of equilibrium with friction within its limits.

    Attributes:
        space: the states in equilibrium.
        program: the program with all friction limits.
        sizes: index of the term of each pair's friction.
        holds: for each pair, {sense of friction: {term: weight in the pair's capacity}}.
        budget: cost limits of the searches.
        root: the cell with which each search begins.
        there: whether any state exists; None if the search ended without an answer.
    """

    space: Space
    program: Program
    sizes: list[int]
    holds: list[dict[int, dict[int, float]]]
    budget: SearchBudget
    root: Cell
    there: bool | None

    @property
    def none(self) -> np.ndarray:
        """A row of zeros over X."""
        return np.zeros(self.space.open + 1)


def admissible_states(
    st: Statics, pairs: tuple, self_stress: Stress | None, budget: SearchBudget, load: int | None = None
) -> AdmissibleStates:
    """The admissible states with all loads at their present amounts, except the load with index ``load``, which is free."""
    s = space(st, pairs, load)
    program, sizes, holds = holding_program(s)
    stress: dict[int, float] = {}
    if self_stress is not None:
        program, stress = limit_self_stress(s, program, self_stress)
    none, root = Row(np.zeros(s.open + 1)), Cell()
    if s.misses > NEVER:
        return AdmissibleStates(s, program, sizes, holds, budget, root, False)
    reach = norm_bounds(program, sizes, holds, stress)
    if reach:
        budget.begin(FIRST)
        program = limit_norms(program.with_objective(none, reach), budget)
        answer = Relaxation(program, budget.is_over).solve({})
        if answer is None:
            return AdmissibleStates(s, program, sizes, holds, budget, root, False)
        root = first_cell(program, answer.X, budget)
    found = minimise(program.with_objective(none), budget, root=root)
    if found.X is None:
        return AdmissibleStates(s, program, sizes, holds, budget, root, False if found.bound == np.inf else None)
    if not reach:
        budget.begin(FIRST)
        program = limit_norms(program, budget)
        root = first_cell(program, found.X, budget)
    return AdmissibleStates(s, program, sizes, holds, budget, root, True)


def state_of(a: AdmissibleStates, X: np.ndarray, endless: bool) -> State:
    """The state at X. If ``endless``, the normalised direction of X."""
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


def end(a: AdmissibleStates, found: Found, sign: float, scale: float) -> End:
    """An end of the interval of a quantity, from a minimisation of sign · quantity."""
    if found.X is None:
        return End(None, float(sign * found.bound * scale), None, found.cells)
    state = state_of(a, found.X / found.X[-1] if found.X[-1] > 0.0 else found.X, found.endless or found.X[-1] <= 0.0)
    if found.endless:
        return End(-sign * np.inf, -sign * np.inf, state, found.cells)
    return End(float(sign * found.value * scale), float(sign * found.bound * scale), state, found.cells)


def interval(a: AdmissibleStates, row: Row, scale: float) -> Interval:
    """The least and largest value of a row over all admissible states, multiplied by ``scale``."""
    return Interval(_extreme(a, row, 1.0, scale), _extreme(a, row, -1.0, scale))


def _extreme(
    a: AdmissibleStates, row: Row, sign: float, scale: float, normal: Row | None = None, floor: float = -np.inf
) -> End:
    """The least (sign 1) or largest (sign −1) value of a row, relative to ``normal`` if given, over all admissible states. floor:
    lower bound of the least value."""
    objective = Row(sign * row.linear, {j: sign * c for j, c in row.norms.items()})
    found = minimise(a.program.with_objective(objective, normal=normal), a.budget, floor if sign > 0 else -np.inf, a.root)
    return end(a, found, sign, scale)


def pair_bounds(a: AdmissibleStates, i: int) -> PairBounds:
    """The intervals of a pair. If only bounds of the capacity are known, the upper bound gives the least share and the largest
    normal force. The lower bound gives the largest share and the least normal force. The kernel's laws give the capacity of the
    only state in equilibrium."""
    pair, size = a.space.pairs[i], a.sizes[i]
    own = Row(a.none, {size: 1.0})
    found = []
    for most, least, b in _states_at_limit(a, i) if pair.limits else _states_by_sense(a, i):
        normal = Interval(_least_force(b, least, pair.static), _extreme(b, _over(most, pair.static), -1.0, a.space.scale))
        pressed = least is most or (least is not None and normal.least.certified >= 0.0)
        largest = _extreme(b, own, -1.0, 1.0, least) if pressed else End(None, 1.0, None, 0)
        found.append((normal, Interval(_extreme(b, own, 1.0, 1.0, most, 0.0), largest)))
    normals, share = [n for n, _ in found], [s for _, s in found]
    if all(i.least.certified == np.inf for i in share):  # no state presses the pair, so the share is 0
        share = [Interval(End(0.0, 0.0, i.least.state, i.least.cells), End(0.0, 0.0, i.least.state, i.least.cells)) for i in share]
    friction = interval(a, Row(a.program.terms[size][0]) if len(pair.eta) == 1 else own, a.space.scale)
    kind, exact = a.space.statics.joint(pair.joint).element.joint.kind_name, all(c.exact for c in pair.capacities)
    both = [_hull(normals), _hull(share)]
    if not exact:
        rubs = a.space.statics.joint(pair.joint).rubs
        eta = [rubs.eta.index(k) for k in pair.eta]
        both = [_with_kernel_values(pair, eta, *each) for each in zip(both, (False, True), strict=True)]
        exact = not a.space.open
        both = [Interval(_certain(i.least), _certain(i.largest)) for i in both] if exact else both
    return PairBounds(pair.joint, pair.part, kind, both[0], friction, both[1], exact)


def _over(row: Row, divisor: float) -> Row:
    return Row(row.linear / divisor, {j: w / divisor for j, w in row.norms.items()})


def _least_force(a: AdmissibleStates, least: Row | None, static: float) -> End:
    """The least normal force. The certified value is negative if the lower bound of the capacity can be negative. The certified
    value is 0 if no lower bound is known."""
    if least is None:
        return End(None, 0.0, None, 0)
    floor = 0.0 if min(least.norms.values(), default=0.0) >= 0.0 else -np.inf
    return _extreme(a, _over(least, static), 1.0, a.space.scale, floor=floor)


def _with_kernel_values(pair: Pair, eta: list[int], found: Interval, share: bool) -> Interval:
    """The interval of the share or the normal force. At its ends, the kernel's laws give the values, because the capacities of the
    program are only bounds. A normal force is at least 0. A share is at most 1, because friction that a pair holds is within its
    capacity. eta: indices of the pair's multipliers among its joint's multipliers."""

    def told(e: End) -> End:
        if e.state is None:
            return e
        joint = e.state.joints[pair.joint]
        of = joint.shares[pair.part - 1]
        size = float(np.linalg.norm(pair.friction @ np.array(joint.friction)[eta]))
        return replace(e, value=of if share else size / (of * pair.static) if of > 0.0 else None)

    low, high = told(found.least), told(found.largest)
    most = 1.0 if share else np.inf
    return Interval(replace(low, certified=max(low.certified, 0.0)), replace(high, certified=min(high.certified, most)))


def _certain(e: End) -> End:
    """An end of an interval at the only state of equilibrium: its value is certified."""
    return e if e.value is None else replace(e, certified=e.value)


def _states_by_sense(a: AdmissibleStates, i: int) -> list[tuple[Row, Row | None, AdmissibleStates]]:
    """(upper bound of the capacity, lower bound or None, admissible states with this capacity) for all senses of a pair's friction
    that have different capacities. An exact capacity is both bounds."""
    made, pair, V = a.holds[i], a.space.pairs[i], a.program.terms[a.sizes[i]][0]
    out = []
    for c in pair.capacities:
        most = Row(a.none, made[c.sense])
        states = _restricted(a, Row(-c.sense * V)) if c.sense else a
        out.append((most, most if c.exact else _lower_bound(a, pair, c), states))
    return out


def _lower_bound(a: AdmissibleStates, pair: Pair, c: Capacity) -> Row | None:
    """The lower bound of a capacity; None if only an upper bound is known."""
    if not c.least:
        return None
    terms = [term_index(list(a.program.terms), a.space.norm_vector(pair, n)) for n in c.norms]
    return Row(a.none, dict(zip(terms, c.least, strict=True)))


def _states_at_limit(a: AdmissibleStates, i: int) -> list[tuple[Row, Row, AdmissibleStates]]:
    """The result of ``_states_by_sense`` with the capacities of a pair at its limit of friction."""
    pair, V, one = a.space.pairs[i], a.program.terms[a.sizes[i]][0], np.append(np.zeros(a.space.open), 1.0 / a.space.scale)
    out = []
    for at in pair.limits:
        load = a.space.norm_vector(pair, Norm(at.rows, 1.0, fixed=at.fixed))[0]
        held = Row(at.weight * load + at.constant * one)
        out.append((held, held, _restricted(a, Row(-at.sense * V), Row(-load))))
    return out


def _restricted(a: AdmissibleStates, *rows: Row) -> AdmissibleStates:
    """Those admissible states that also satisfy these rows."""
    return replace(a, program=a.program.with_objective(a.program.objective, rows))


def _hull(found: list[Interval]) -> Interval:
    """The smallest interval that contains all given intervals."""
    there = [i for i in found if i.least.certified < np.inf and i.largest.certified > -np.inf] or found
    low = min(there, key=lambda i: i.least.value if i.least.value is not None else np.inf)
    high = max(there, key=lambda i: i.largest.value if i.largest.value is not None else -np.inf)
    bounds = min(i.least.certified for i in there), max(i.largest.certified for i in there)
    return Interval(
        End(low.least.value, bounds[0], low.least.state, low.least.cells),
        End(high.largest.value, bounds[1], high.largest.state, high.largest.cells),
    )


def feasible(a: AdmissibleStates, program: Program) -> bool | None:
    """Whether the program has a state; None if the search ended without an answer."""
    found = minimise(program.with_objective(Row(a.none)), a.budget, root=a.root)
    return True if found.X is not None else False if found.bound == np.inf else None


def is_pushed(a: AdmissibleStates, m: Motion) -> bool:
    """Whether any load may push the pairs of a motion. If no load pushes these pairs, there is only one state, and the friction of
    these pairs is zero. The motion then does not begin by itself, although the pairs could not resist the motion."""
    if a.space.open:
        return True
    return any(float(np.abs(a.program.terms[a.sizes[i]][0]).max(initial=0.0)) > FEASIBLE for i in m.moving)


def find_onsets(a: AdmissibleStates, every: list[Motion]) -> list[tuple[Motion, bool | None]]:
    """(motion, True) for each motion that can begin from an admissible state, in either sense. None in place of True means that
    the search ended without an answer."""
    out = []
    for m in (m for m in every if is_pushed(a, m)):
        answers = [feasible(a, restrict_to_onset(a.space, a.program, m, s)) for s in (1.0, -1.0)]
        if any(x is not False for x in answers):
            out.append((m, True if True in answers else None))
    return out


def load_bounds(st: Statics, pairs: tuple, self_stress: Stress | None, budget: SearchBudget, k: int, drive: bool) -> LoadBounds:
    """The range of a load, or of a drive's effort, before a pair slips. k: index of the load or drive."""
    load = (st.drives if drive else st.loads)[k]
    a = admissible_states(st, pairs, self_stress, budget, None if drive else k)
    amount = a.space.amount(st.multipliers + k if drive else len(a.space.origin) - 1)
    found, _, _ = motions(st, pairs, k if drive else None)
    ways = []
    for sign in (1.0, -1.0):
        possible = end(a, minimise(a.program.with_objective(Row(-sign * amount)), budget, root=a.root), -sign, a.space.scale)
        rows = () if drive else (Row(_at_least(sign, amount, load.now / a.space.scale)),)
        ends = []
        for m, sense in _onset_senses(st, found, k, sign, drive):
            program = restrict_to_onset(a.space, a.program, m, sense).with_objective(Row(sign * amount), rows)
            ends.append((end(a, minimise(program, budget, root=a.root), sign, a.space.scale), m))
        ways.append(_breakaway(pairs, possible, ends, sign, np.nan if drive else load.now))
    low, high, error = ways[1].possible.certified, ways[0].possible.certified, FEASIBLE * a.space.scale
    result = LoadBounds(load.name, load.unit, None if drive else load.now, *ways)
    return result if drive or low - error <= load.now <= high + error else without_guarantee(result)


def without_guarantee(load: LoadBounds) -> LoadBounds:
    """The bounds of a load if no state holds its present amount."""
    none = End(None, float("nan"), None, 0)
    return replace(load, more=replace(load.more, guaranteed=none), less=replace(load.less, guaranteed=none))


def _at_least(sign: float, amount: np.ndarray, now: float) -> np.ndarray:
    """The row sign · (now − amount) ≤ 0: in the direction ``sign``, the load is at its present amount or beyond."""
    out = -sign * amount
    out[-1] += sign * now
    return out


def _onset_senses(st: Statics, found: list[Motion], k: int, sign: float, drive: bool) -> list[tuple[Motion, float]]:
    """(motion, sense) for the motions that a load may start. A drive starts only motions along its effort."""
    if not drive:
        return [(m, s) for m in found for s in (1.0, -1.0)]
    out = []
    for m in found:
        rates = st.driven[k] @ m.rates
        if float(np.abs(rates).max()) > 1e-9 * float(np.abs(m.rates).max()):
            out.append((m, sign if rates[0] > 0.0 else -sign))
    return out


def _breakaway(pairs: tuple, possible: End, ends: list[tuple[End, Motion]], sign: float, now: float) -> Breakaway:
    """The motion that begins first, and the load up to which no motion can begin.

    This load is limited to the largest load for which a state was found, or to the present load if no state was found. The
    limitation is needed because ``possible.certified`` excludes states beyond its value, but does not prove that states exist
    below.
    """
    held = now if possible.value is None else possible.value
    there = [(e, m) for e, m in ends if e.value is not None or e.certified != sign * np.inf]
    if not there:
        return Breakaway(End(None, held, None, sum(e.cells for e, _ in ends)), possible, ())
    first, motion = min(there, key=lambda em: sign * (em[0].certified if em[0].value is None else em[0].value))
    certified = sign * min(sign * held, *(sign * e.certified for e, _ in there))
    joints = tuple(dict.fromkeys(pairs[i].joint for i in motion.moving))
    return Breakaway(End(first.value, certified, first.state, first.cells), possible, joints)
