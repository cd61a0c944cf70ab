"""FMUs of the tests are compiled without optimisation, because compilation would otherwise take half of the tests' time. On
processors without fused operations, their results have the same bits as with optimisation."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from trunnion.fmu.binaries import platform_builds
from trunnion.kernel.compilation import c_compiler


@pytest.fixture(scope="package", autouse=True)
def delivered_flags() -> Iterator[Callable[[str, str], tuple[str, ...]]]:
    """Compile the generated files of FMUs with ``QUICK``, and return the function that chooses the flags of delivered FMUs."""
    chosen = c_compiler.optimised_flags
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_compiler, "optimised_flags", lambda unit, text: c_compiler.QUICK)
        patch.setattr(platform_builds, "PARTS", dict.fromkeys(platform_builds.PARTS, c_compiler.QUICK))
        yield chosen
