"""HTTP requests to a server. Error responses are raised as exceptions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import httpx

from trunnion.basics.errors import Problem, SceneError, SimulationError
from trunnion.basics.renamed_words import add_note

DEFAULT_URL = "http://127.0.0.1:8765"
ENDED = ("done", "failed", "cancelled")
WARNING = '299 trunnion "'
"""Beginning of a Warning header that contains a note about a deprecated word."""


class Server:
    """A connection to a server. Problem documents are raised as SceneError (wrong use) or SimulationError."""

    def __init__(self, url: str, key: str):
        try:
            if not httpx.URL(url).host:
                raise ValueError("it names no host")
            self.http = httpx.Client(base_url=url, timeout=120, headers={"Authorization": f"Bearer {key}"} if key else {})
        except (httpx.InvalidURL, ValueError) as e:
            raise SceneError([Problem("--server", f"{url!r} is not an address: {e}", f"such as {DEFAULT_URL}")]) from e
        self.url = url

    def request(self, method: str, path: str, **more: Any) -> httpx.Response:
        """Send a request; errors as in ``raise_problems``."""
        try:
            answer = self.http.request(method, path, **more)
        except httpx.HTTPError as e:
            raise SimulationError(
                f"no answer from {self.url}: {e}\nIs the server running? Start a server with: trunnion serve"
            ) from e
        return raise_problems(answer)

    def save(self, path: str, file: Path, **more: Any) -> None:
        """Stream a response into a file. The file is written atomically."""
        from trunnion.basics.atomic_files import writing

        with writing(file, (file.suffix.lower(),)) as work:
            try:
                with self.http.stream("GET", path, **more) as answer, work.open("wb") as f:
                    if answer.status_code >= 400:
                        answer.read()
                    raise_problems(answer)
                    for piece in answer.iter_bytes():
                        f.write(piece)
            except httpx.HTTPError as e:
                raise SimulationError(f"no answer from {self.url}: {e}") from e


def read_problems(document: dict[str, Any]) -> list[Problem]:
    """The problems in a problem document. The last problem can stand for several problems."""
    told = [Problem(**p) for p in document["problems"]]
    more = int(document.get("problem_count", len(told))) - len(told) + 1
    return [*told[:-1], replace(told[-1], count=more)] if told and more > 1 else told


def raise_problems(answer: httpx.Response) -> httpx.Response:
    """Return a successful response. For an error response, raise SceneError with the listed problems, or SimulationError if the
    response lists none. Notes about deprecated words in the response are added to the notes of this process."""
    for warning in answer.headers.get_list("warning"):
        if warning.startswith(WARNING):
            add_note(unquote(warning.removeprefix(WARNING).rstrip('"')))
    if answer.status_code < 400:
        return answer
    try:
        document = answer.json()
        problems = read_problems(document)
        text = f"{document['title']}: {document['detail']}"
    except (ValueError, KeyError, TypeError):
        problems, text = [], f"status {answer.status_code} from the server"
    if problems:
        raise SceneError(problems)
    raise SimulationError(text)
