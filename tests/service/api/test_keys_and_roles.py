"""Keys, roles, the loopback exception, the rate limit, and the origin of a request."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.service.http_servers import SMALL, InProcess, unstarted
from trunnion.service.api.transport.api_keys_and_rates import new_key
from trunnion.service.basics.server_settings import Limits, Settings


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[InProcess, dict[str, str]]]:
    """A server that requires keys, and one key of each role."""
    with unstarted(Settings(tmp_path_factory.mktemp("guarded"), host="0.0.0.0")) as s:
        made = {}
        for role in ("read", "submit", "admin"):
            key, made[role] = new_key(role, role)
            s.service.store.add_key(key)
        yield s, made


def with_key(key: str) -> dict[str, Any]:
    return {"headers": {"Authorization": f"Bearer {key}"}}


def test_requests_without_a_key_get_no_data(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    for path in ("/v1/jobs", "/v1/models", "/v1/keys", "/metrics"):
        answer = s.get(path)
        assert (answer.status_code, answer.headers["www-authenticate"]) == (401, "Bearer")
    for wrong in ("x", "tr_000000000000_x", keys["read"][:-1], keys["read"] + "é", ""):
        assert s.get("/v1/jobs", headers={"X-API-Key": wrong.encode("latin-1")}).status_code == 401
    assert s.get("/healthz").status_code == 200


def test_each_role_has_its_rights_only(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    statuses = {
        role: [
            s.get("/v1/jobs", **with_key(key)).status_code,
            s.post("/v1/jobs", SMALL | {"until": -1}, **with_key(key)).status_code,
            s.post("/v1/sensitivities", {"parameters": [], "outputs": []}, **with_key(key)).status_code,
            s.get("/v1/keys", **with_key(key)).status_code,
        ]
        for role, key in keys.items()
    }
    assert statuses == {"read": [200, 403, 403, 403], "submit": [200, 422, 422, 403], "admin": [200, 422, 422, 200]}


def test_a_key_works_from_when_it_is_made_until_it_is_revoked(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    made = s.post("/v1/keys", {"name": "robot", "role": "read"}, **with_key(keys["admin"]))
    assert made.status_code == 201
    key, identity = made.json()["key"], made.json()["id"]
    assert s.get("/v1/jobs", headers={"X-API-Key": key}).status_code == 200
    assert key not in s.get("/v1/keys", **with_key(keys["admin"])).text
    assert s.client.delete(f"/v1/keys/{identity}", **with_key(keys["admin"])).status_code == 204
    assert s.get("/v1/jobs", headers={"X-API-Key": key}).status_code == 401


def test_a_key_in_a_cookie_lets_a_page_look_but_not_act(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    cookie = {"headers": {"Cookie": f"trunnion_key={keys['admin']}"}}
    assert s.get("/v1/jobs", **cookie).status_code == 200
    assert s.post("/v1/jobs", SMALL, **cookie).status_code == 401


def test_keys_are_kept_as_hashes_only(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    data = b"".join(f.read_bytes() for f in s.service.settings.data.glob("trunnion.db*"))
    secrets = [k.split("_", 2)[2] for k in keys.values()]  # the secret may contain "_"
    assert all(len(x) > 40 and x.encode() not in data for x in secrets)


@pytest.mark.parametrize(
    ("host", "keys", "opened"),
    [
        ("127.0.0.1", False, True),
        ("::1", False, True),
        ("localhost", False, True),
        ("127.0.0.1", True, False),
        ("0.0.0.0", False, False),
        ("10.1.2.3", False, False),
        ("example.org", False, False),
        ("localhost.example.org", False, False),
    ],
)
def test_keys_are_off_only_where_nobody_else_can_connect(host: str, keys: bool, opened: bool) -> None:
    assert Settings(Path(), host=host, require_keys=keys).open is opened


def test_without_keys_only_this_machines_own_pages_are_answered(server: InProcess) -> None:
    assert server.get("/v1/jobs", headers={"Host": "evil.example"}).status_code == 403
    assert server.get("/v1/jobs", headers={"Host": "localhost:1234"}).status_code == 200
    assert server.post("/v1/jobs", SMALL, headers={"Origin": "http://evil.example"}).status_code == 403
    assert server.post("/v1/jobs", SMALL | {"until": -1}, headers={"Origin": "http://127.0.0.1"}).status_code == 422


def test_more_requests_than_the_rate_are_refused_with_when_to_come_again(tmp_path: Path) -> None:
    with unstarted(Settings(tmp_path, limits=Limits(rate="5/hour"))) as s:
        statuses = [s.get("/v1/models").status_code for _ in range(7)]
        assert statuses == [200] * 5 + [429] * 2
        assert 0 < int(s.get("/v1/jobs").headers["retry-after"]) <= 3601
        assert s.get("/healthz").status_code == 200
