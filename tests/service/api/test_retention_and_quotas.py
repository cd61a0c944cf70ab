"""Jobs are found by tags and text, expire, and are deleted with all their files. Each key has a quota. The audit log records
actions with their key."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.service.api.test_keys_and_roles import with_key
from tests.service.http_servers import MU, SMALL, InProcess, unstarted
from tests.service.store.test_store_contract import ME, submitted, taken
from trunnion.basics.errors import SceneError
from trunnion.service.api.transport.api_keys_and_rates import new_key
from trunnion.service.basics.server_settings import Limits, Settings
from trunnion.service.cli.serve import kept_for
from trunnion.service.executor.job_retention import JobRetention
from trunnion.service.executor.parquet_parts import Parts
from trunnion.service.store.leases_and_chunks import WorkStore


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[InProcess, dict[str, str]]]:
    """A server that requires keys, and its keys. Each key may have two jobs and 100 cases."""
    limits = Limits(key_jobs=2, key_cases=100)
    with unstarted(Settings(tmp_path_factory.mktemp("guarded"), host="0.0.0.0", limits=limits)) as s:
        found = {}
        for name, role in (("read", "read"), ("mine", "submit"), ("yours", "submit"), ("admin", "admin")):
            key, found[name] = new_key(name, role)
            s.service.store.add_key(key)
        yield s, found


def test_a_job_that_has_ended_is_deleted_with_all_it_has_kept(server: InProcess) -> None:
    job = server.submit(SMALL)
    place = server.service.settings.data / "results" / job
    server.ended(job)
    assert place.exists()
    assert server.client.delete(f"/v1/jobs/{job}", params={"purge": True}).status_code == 204
    assert not place.exists()
    for path in ("", "/results", "/request", "/events", "/attempts", "/cases/0/trajectory"):
        assert server.get(f"/v1/jobs/{job}{path}").status_code == 404
    assert job not in [j["id"] for j in server.get("/v1/jobs").json()["jobs"]]


def test_a_job_that_continues_is_not_deleted(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    job = s.submit(SMALL, **with_key(keys["mine"]))
    assert s.client.delete(f"/v1/jobs/{job}?purge=true", **with_key(keys["mine"])).status_code == 409
    s.client.delete(f"/v1/jobs/{job}", **with_key(keys["mine"]))
    assert s.client.delete(f"/v1/jobs/{job}?purge=true", **with_key(keys["yours"])).status_code == 403
    assert s.client.delete(f"/v1/jobs/{job}?purge=true", **with_key(keys["mine"])).status_code == 204


def test_jobs_are_found_by_tags_and_by_words(server: InProcess) -> None:
    asked = SMALL | {"until": 0.01, "tags": ["guide", "a_b"], "label": "Second try, 50 %"}
    job = server.submit(asked)

    def ids(**how: str) -> list[str]:
        return [j["id"] for j in server.get("/v1/jobs", params=how).json()["jobs"]]

    assert ids(tag="guide") == ids(tag="a_b") == ids(search="second TRY") == ids(search="50 %") == ids(search=job[3:20]) == [job]
    assert ids(tag="guid") == ids(tag="a.b") == ids(search="50%") == []
    after = server.client.patch(f"/v1/jobs/{job}", json={"tags": ["kept"]}).json()
    assert (after["tags"], after["label"]) == (["kept"], asked["label"])
    assert (ids(tag="guide"), ids(tag="kept")) == ([], [job])
    assert server.client.patch(f"/v1/jobs/{job}", json={"tags": ["no blanks"]}).status_code == 422


def test_a_key_has_no_more_than_its_share(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    made = [s.post("/v1/jobs", SMALL, **with_key(keys["yours"])) for _ in range(3)]
    assert [a.status_code for a in made] == [202, 202, 429]
    assert {p["where"] for p in made[2].json()["problems"]} == {"quota.jobs", "quota.cases"}
    usage = s.get("/v1/usage", **with_key(keys["yours"])).json()
    assert (usage["jobs"], usage["cases"], usage["most"]["cases"]) == (2, 80, 100)
    assert s.post("/v1/jobs", SMALL | {"vary": {MU: "0.1:0.6:10"}}, **with_key(keys["admin"])).status_code == 202


def test_cases_of_a_day_are_not_given_back_by_deleting_their_job(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    before = s.get("/v1/usage", **with_key(keys["mine"])).json()["cases"]
    job = s.submit(SMALL | {"vary": {MU: "0.1:0.6:7"}}, **with_key(keys["mine"]))
    for how in ("", "?purge=true"):
        s.client.delete(f"/v1/jobs/{job}{how}", **with_key(keys["mine"]))
    assert s.get(f"/v1/jobs/{job}", **with_key(keys["mine"])).status_code == 404
    assert s.get("/v1/usage", **with_key(keys["mine"])).json()["cases"] == before + 7


def test_administrators_see_actions_with_their_keys(guarded: tuple[InProcess, dict[str, str]]) -> None:
    s, keys = guarded
    job = s.submit(SMALL | {"vary": {MU: [0.1]}}, **with_key(keys["admin"]))
    s.client.delete(f"/v1/jobs/{job}", **with_key(keys["admin"]))
    s.client.delete(f"/v1/jobs/{job}?purge=true", **with_key(keys["admin"]))
    audit_records = s.get("/v1/audit", params={"about": job}, **with_key(keys["admin"])).json()
    identity = keys["admin"].split("_")[1]
    assert [(d["what"], d["who"]) for d in audit_records] == [(w, identity) for w in ("submitted", "cancelled", "deleted")]
    assert s.get("/v1/audit", params={"after": audit_records[-1]["id"]}, **with_key(keys["admin"])).json() == []
    made = s.post("/v1/keys", {"name": "robot", "role": "read"}, **with_key(keys["admin"])).json()
    s.client.delete(f"/v1/keys/{made['id']}", **with_key(keys["admin"]))
    audit_records = s.get("/v1/audit", params={"about": made["id"]}, **with_key(keys["admin"]))
    assert [d["what"] for d in audit_records.json()] == ["made a key", "revoked a key"]
    assert made["key"] not in audit_records.text
    assert s.get("/v1/audit", **with_key(keys["mine"])).status_code == 403


def test_expired_jobs_and_leftover_parts_are_deleted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store, parts = WorkStore(f"sqlite:///{tmp_path / 'store.db'}"), Parts(str(tmp_path / "parts"))
    store.upgrade()
    jobs = [taken(store), taken(store), submitted(store)]
    for job in jobs[:2]:
        store.end(ME, job.id, "cancelled", [])
    for name in (*(j.id for j in jobs), "0" * 24, "mine"):
        parts.write(f"{parts.root}/{name}/job.json", b"{}")
    retention, now = JobRetention(store, parts, Settings(tmp_path, keep=kept_for("30d"))), store.now
    assert retention.delete_expired() == 0
    assert (tmp_path / "parts" / ("0" * 24)).exists()  # the folder may belong to another database
    store.note("me", "deleted", "0" * 24)  # the server behaves as if it had ended before it removed the parts
    retention.delete_expired()
    assert not (tmp_path / "parts" / ("0" * 24)).exists()
    store.mark(jobs[0].id, "kept in mind", None)
    monkeypatch.setattr(store, "now", lambda c: now(c) + 31 * 86_400.0)
    assert retention.delete_expired() == 2
    assert [store.job(j.id) is None for j in jobs] == [True, True, False]
    assert sorted(p.name for p in (tmp_path / "parts").iterdir()) == sorted([jobs[2].id, "mine"])
    assert [d["who"] for d in store.audit_records()] == ["me"] * 4 + ["server"] * 2
    store.close()


def test_times_to_keep_jobs_for_are_read_with_their_units() -> None:
    assert [kept_for(t) for t in ("", "0", "600", "45m", "12h", "30d")] == [0.0, 0.0, 600.0, 2700.0, 43_200.0, 2_592_000.0]
    for wrong in ("x", "-1d", "1w", "nan", "1e999"):
        with pytest.raises(SceneError, match="--keep"):
            kept_for(wrong)


@pytest.mark.parametrize("text", ["30s", "9m", "599"])
def test_a_retention_time_below_ten_minutes_is_refused(text: str) -> None:
    """The server looks for expired jobs every ten minutes."""
    with pytest.raises(SceneError, match=f"{text} is shorter than the 10 min"):
        kept_for(text)
