"""FMUs of the bundled models without loops, and of every friction law, give what the engine gives."""

from __future__ import annotations

import pytest

from .hosting import claim_equal_to_engine


@pytest.mark.parametrize("model", ["simple_pendulum", "cart_pole", "governor", "spherical_pendulum", "double_pendulum"])
def test_both_flavours_are_the_engine(model: str) -> None:
    claim_equal_to_engine(model)


@pytest.mark.parametrize("law", ["lugre", "stribeck", "regularized"])
def test_with_other_laws_too(law: str) -> None:
    claim_equal_to_engine(f"spherical_pendulum:{law}")
