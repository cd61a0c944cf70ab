"""Requests to a server, and what its errors are here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx

from engine.basics.problems import Problem, SceneError, SimulationError

HERE = "http://127.0.0.1:8765"
ENDED = ("done", "failed", "cancelled")


class Server:
    """Requests to a server; its problem documents become SceneError (wrong use) or SimulationError."""

    def __init__(self, url: str, key: str):
        try:
            if not httpx.URL(url).host:
                raise ValueError("it names no host")
            self.http = httpx.Client(base_url=url, timeout=120, headers={"Authorization": f"Bearer {key}"} if key else {})
        except (httpx.InvalidURL, ValueError) as e:
            raise SceneError([Problem("--server", f"{url!r} is no address: {e}", f"such as {HERE}")]) from e
        self.url = url

    def ask(self, method: str, path: str, **more: Any) -> httpx.Response:
        """Send a request and return its answer; an error answer is raised as ``checked`` says."""
        try:
            answer = self.http.request(method, path, **more)
        except httpx.HTTPError as e:
            raise SimulationError(f"no answer from {self.url}: {e}\nIs it running? Start one with: trunnion serve") from e
        return checked(answer)

    def save(self, path: str, file: Path, **more: Any) -> None:
        """Stream an answer into a file, whole or not at all."""
        from engine.basics.files import writing

        with writing(file, (file.suffix.lower(),)) as work:
            try:
                with self.http.stream("GET", path, **more) as answer, work.open("wb") as f:
                    if answer.status_code >= 400:
                        answer.read()
                    checked(answer)
                    for piece in answer.iter_bytes():
                        f.write(piece)
            except httpx.HTTPError as e:
                raise SimulationError(f"no answer from {self.url}: {e}") from e


def problems_of(document: dict[str, Any]) -> list[Problem]:
    """The problems of a problem document; its last line may stand for many."""
    told = [Problem(**p) for p in document["problems"]]
    more = int(document.get("problem_count", len(told))) - len(told) + 1
    return [*told[:-1], replace(told[-1], count=more)] if told and more > 1 else told


def checked(answer: httpx.Response) -> httpx.Response:
    """The answer when it is no error; else SceneError with the problems it lists, or SimulationError when it lists none."""
    if answer.status_code < 400:
        return answer
    try:
        document = answer.json()
        problems = problems_of(document)
        text = f"{document['title']}: {document['detail']}"
    except (ValueError, KeyError, TypeError):
        problems, text = [], f"status {answer.status_code} from the server"
    if problems:
        raise SceneError(problems)
    raise SimulationError(text)
