"""Delivery of finished results over HTTP: unchanged results are not sent again; results are sent in parts and compressed. The
server sends answers at once."""

from __future__ import annotations

import asyncio
import socket

import pytest

from tests.service.http_servers import SMALL, InProcess
from trunnion.service.cli.serve import listener


@pytest.fixture(scope="module")
def small(server: InProcess) -> str:
    """A finished job of 40 cases."""
    job = server.submit(SMALL)
    assert server.ended(job)["state"] == "done"
    return job


def test_finished_results_are_had_again_only_when_they_have_changed(server: InProcess, small: str) -> None:
    place = f"/v1/jobs/{small}/results"
    tags = set()
    for kind in ("json", "csv", "parquet", "arrow"):
        plain = {"Accept-Encoding": "identity"}
        got = server.get(place, params={"format": kind}, headers=plain)
        tags.add(got.headers["etag"])
        again = server.get(place, params={"format": kind}, headers=plain | {"If-None-Match": got.headers["etag"]})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", got.headers["etag"])
        other = server.get(place, params={"format": kind, "first": 1}, headers=plain | {"If-None-Match": got.headers["etag"]})
        assert other.status_code == 200
        head = server.client.head(place, params={"format": kind}, headers=plain)
        assert (head.status_code, head.headers["etag"]) == (200, got.headers["etag"])
    assert len(tags) == 4


def test_parts_of_finished_results_can_be_asked_for(server: InProcess, small: str) -> None:
    place, plain = f"/v1/jobs/{small}/results?format=parquet", {"Accept-Encoding": "identity"}
    all_of_it = server.get(place, headers=plain)
    whole, n = all_of_it.content, len(all_of_it.content)
    for text, part in (("0-99", whole[:100]), ("100-", whole[100:]), ("-7", whole[-7:]), (f"10-{10 * n}", whole[10:])):
        got = server.get(place, headers=plain | {"Range": f"bytes={text}", "If-Range": all_of_it.headers["etag"]})
        assert (got.status_code, got.content) == (206, part)
        assert got.headers["content-range"] == f"bytes {whole.index(part)}-{whole.index(part) + len(part) - 1}/{n}"
    assert server.get(place, headers=plain | {"Range": f"bytes={n}-"}).status_code == 416
    assert server.get(place, headers=plain | {"Range": "bytes=0-9", "If-Range": '"another"'}).content == whole
    assert server.get(place, headers=plain | {"Range": "bytes=0-1,5-6"}).content == whole


def test_text_comes_compressed_to_whom_that_suits(server: InProcess, small: str) -> None:
    for kind, packed in (("json", True), ("csv", True), ("parquet", False)):
        place = f"/v1/jobs/{small}/results?format={kind}"
        got, plain = (server.get(place, headers={"Accept-Encoding": e}) for e in ("br, gzip", "gzip;q=0"))
        assert (got.headers.get("content-encoding"), plain.headers.get("content-encoding")) == ("gzip" if packed else None, None)
        assert got.content == plain.content
        assert (got.headers["etag"] != plain.headers["etag"]) == packed


def test_answers_are_sent_at_once_and_not_held_until_the_last_one_was_received() -> None:
    """Without TCP_NODELAY, the body of an answer waits until the client acknowledges the head. This takes 44 ms for each answer, on
    an idle or busy server."""

    async def accepted() -> int:
        sent = asyncio.get_running_loop().create_future()
        taken = listener("127.0.0.1", 0)
        server = await asyncio.start_server(lambda _, writer: sent.set_result(writer), sock=taken)
        _, mine = await asyncio.open_connection(*taken.getsockname())
        writer = await sent
        option = writer.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        for w in (mine, writer):
            w.close()
        server.close()
        return int(option)

    assert asyncio.run(accepted()) != 0
