"""fmpy's validation of an FMU. fmpy needs 30 ms to parse a variable name. Each process therefore parses each form of name only
once."""

from __future__ import annotations

import re
from typing import IO, Any

import pytest
from fmpy.validation import validate_fmu
from lark import Lark

_legal: set[str] = set()
"""Forms of names that were parsed without a mistake."""


def form(name: str) -> str:
    """A name in which ``a`` replaces each identifier and ``1`` each number. The grammar accepts the new name if and only if it
    accepts the original name."""
    return re.sub(r"[0-9]+", "1", re.sub(r"(?!der\()[A-Za-z_][A-Za-z_0-9]*", "a", name))


def validated(fmu: str | IO[bytes]) -> list[str]:
    """The problems that fmpy finds."""
    whole = Lark.parse

    def parse(parser: Lark, name: str, *rest: Any) -> Any:
        if form(name) in _legal:
            return None
        tree = whole(parser, name, *rest)
        _legal.add(form(name))
        return tree

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Lark, "parse", parse)
        return validate_fmu(fmu)
