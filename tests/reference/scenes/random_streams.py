"""Named streams of random numbers. A new option of a choice changes no choice between old options. Also the search for cases with a
property."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tests.reference.scenes.random_scenes import Case

SEARCHED = 400
"""Number of random scenes tried before a property counts as absent."""


def stream(*names) -> np.random.Generator:
    """Random numbers that depend only on the given names."""
    return np.random.default_rng(_hashed(*names))


def chosen(options: Iterable[str], *names) -> str:
    """One of the options, with a frequency equal to the number of times that it is listed. Every option draws one number, and the
    option with the largest number wins. A new option therefore replaces some choices, and changes no choice between the old
    options."""
    return max(enumerate(options), key=lambda o: (_hashed(*names, o[1], list(options)[: o[0]].count(o[1])), o[0]))[1]


def _hashed(*names) -> int:
    return int.from_bytes(hashlib.blake2b("/".join(map(str, names)).encode(), digest_size=8).digest(), "big")


def first(what: str, holds: Callable[[Case], bool], make: Callable[[int], Case]) -> Case:
    """The first random case with a property."""
    for seed in range(SEARCHED):
        case = make(seed)
        if holds(case):
            return case
    raise LookupError(f"no random case among {SEARCHED} has {what}")


def covering(claims: Mapping[str, Callable[[Case], bool]], make: Callable[[int], Case], least: int = 0) -> dict[int, Case]:
    """The first ``least`` random cases. From the following cases, those that first fulfil a claim are added, until every claim has
    a case."""
    missing, kept = dict(claims), {}
    for seed in range(SEARCHED):
        case = make(seed)
        held = [c for c, holds in missing.items() if holds(case)]
        if held or seed < least:
            kept[seed] = case
        for claim in held:
            del missing[claim]
        if not missing and seed + 1 >= least:
            return kept
    raise LookupError(f"no random case among {SEARCHED} has {', '.join(missing)}")
