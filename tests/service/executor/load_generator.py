"""Load and measurement in separate processes, so that the threads of the test do not affect the figures of the server.

``python -m tests.service.executor.load_generator crowd URL KEY CLIENTS`` sends hostile checks until it is ended, ``… readers URL
KEY CLIENTS PATH`` requests a path repeatedly; ``python -m tests.service.executor.load_generator probe URL KEY PATH SECONDS``
prints as JSON the time of each answer, s, and the time of each answer of an idle event loop, s.
"""

from __future__ import annotations

import asyncio
import http.client
import json
import socket
import sys
import threading
import time
from urllib.parse import urlsplit

PAUSE = 0.02
ANSWER = b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nok"


def crowd(url: str, key: str, clients: str) -> None:
    """Send hostile checks until the process is ended."""
    from tests.service.api.test_overload_protection import crowd as threads

    for t in threads(url, key, threading.Event(), int(clients)):
        t.join()


def readers(url: str, key: str, clients: str, path: str) -> None:
    """Send the same request repeatedly until the process is ended."""

    def ask() -> None:
        c = http.client.HTTPConnection(urlsplit(url).hostname or "", urlsplit(url).port, timeout=600)
        while True:
            c.request("GET", path, headers={"X-API-Key": key})
            answer = c.getresponse()
            answer.read()
            assert answer.status in (200, 429, 503), answer.status

    threads = [threading.Thread(target=ask) for _ in range(int(clients))]
    for t in threads:
        t.start()
    for t in threads:
        t.join()


def idle() -> int:
    """The port of an event loop in a separate process. The loop answers every request at once."""
    import multiprocessing

    here, there = multiprocessing.Pipe()
    multiprocessing.get_context("fork").Process(target=_answering, args=(there,), daemon=True).start()
    return int(here.recv())


def _answering(port: object) -> None:
    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while await reader.readuntil(b"\r\n\r\n"):
                writer.write(ANSWER)
        except asyncio.IncompleteReadError:
            writer.close()

    async def serve() -> None:
        server = await asyncio.start_server(answer, "127.0.0.1", 0, family=socket.AF_INET)
        port.send(server.sockets[0].getsockname()[1])  # type: ignore[attr-defined]
        await server.serve_forever()

    asyncio.run(serve())


def probe(url: str, key: str, path: str, seconds: str) -> None:
    """Send requests one by one. Requests to the server and to the idle loop alternate."""
    place = urlsplit(url)
    both = {
        "asked": (http.client.HTTPConnection(place.hostname or "", place.port, timeout=60), path),
        "idle": (http.client.HTTPConnection("127.0.0.1", idle(), timeout=60), "/"),
    }
    taken: dict[str, list[float]] = {name: [] for name in both}
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        for name, (connection, where) in both.items():
            began = time.perf_counter()
            connection.request("GET", where, headers={"X-API-Key": key})
            answer = connection.getresponse()
            answer.read()
            assert answer.status == 200
            taken[name].append(time.perf_counter() - began)
        time.sleep(PAUSE)
    print(json.dumps(taken))


if __name__ == "__main__":
    {"crowd": crowd, "probe": probe, "readers": readers}[sys.argv[1]](*sys.argv[2:])
