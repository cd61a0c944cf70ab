"""A job of a server as it can be looked at without fetching it whole (see ``remote.Job``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from engine.basics.problems import Problem, SceneError

Ends = tuple[float | None, float | None]


class Looks:
    """What there is to look at of a job."""

    def _ask(self, method: str, path: str = "", **more: Any) -> Any:
        raise NotImplementedError

    def bins(
        self,
        x: str,
        y: str = "",
        of: str = "",
        *,
        nx: int = 60,
        ny: int = 60,
        within: Mapping[str, Ends | Sequence[str]] | None = None,
    ) -> dict[str, Any]:
        """All its cases counted in bins over one or two columns, with the least, mean and largest value of a third, as
        ``GET …/bins`` tells them. within: {column: (low, high), None for no end; or words}, which cases are counted."""
        asked = {"x": x, "y": y, "of": of, "nx": nx, "ny": ny, "within": [_condition(n, c) for n, c in (within or {}).items()]}
        return dict(self._ask("GET", "/bins", params=asked).json())

    def events(self, case: int) -> dict[str, Any]:
        """The events of one case, run again on the server: ``{"events": [{"time", "kind", "joint", "text"}], "count",
        "outcome"}``."""
        return dict(self._ask("GET", f"/cases/{case}/events").json())

    @property
    def scene_text(self) -> str:
        """Its scene as YAML, to be changed and submitted again."""
        return str(self._ask("GET", "/scene").text)


def _condition(name: str, given: Ends | Sequence[str]) -> str:
    if all(isinstance(word, str) for word in given):
        return f"{name}={','.join(map(str, given))}"
    if len(given) != 2:
        raise SceneError([Problem("within", f"{name}: {given!r} are no two ends", "(low, high), None for no end")])
    return f"{name}=" + ":".join("" if end is None else f"{end!r}" for end in given)


class Silent:
    """A bar that shows nothing."""

    def __enter__(self) -> Silent:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def tell(self, done: float, of: float) -> None:
        """Show nothing."""
