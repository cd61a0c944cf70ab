"""The OpenAPI document is complete and true: whatever is sent, the answer is one it describes, and never the server's fault."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import Unsatisfiable
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from tests.service.serving import Served

CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
]


@pytest.fixture(scope="module")
def fuzzed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    limits = [w for limit in ("cases=200", "duration=1", "rows=2000", "body=100000") for w in ("--limit", limit)]
    with Served(tmp_path_factory.mktemp("fuzzed") / "data", "--workers", "1", *limits) as s:
        yield s


@pytest.fixture(scope="module")
def api_schema(fuzzed: Served) -> Any:
    return schemathesis.openapi.from_url(f"http://127.0.0.1:{fuzzed.port}/openapi.json")


def tried(schema: Any, examples: int) -> list[str]:
    """Send right and wrong requests to every operation; what is wrong with the answers."""
    wrong: list[str] = []
    for found in schema.get_all_operations():
        operation = found.ok()
        for mode in GenerationMode.POSITIVE, GenerationMode.NEGATIVE:

            @given(case=operation.as_strategy(generation_mode=mode))
            @settings(
                max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck), database=None, derandomize=True
            )
            def one(case: Any) -> None:
                case.call_and_validate(checks=CHECKS, timeout=60)

            try:
                one()
            except Unsatisfiable:  # nothing of this kind can be asked here
                continue
            except Exception as e:  # noqa: BLE001  # all operations are tried before any is complained about
                wrong.append(f"{operation.label}: {e}")
    return wrong


def test_every_answer_is_one_the_document_describes(api_schema: Any) -> None:
    assert tried(api_schema, 8) == []


@pytest.mark.slow
def test_every_one_of_many_answers_is_one_the_document_describes(api_schema: Any) -> None:
    assert tried(api_schema, 60) == []


def test_every_operation_has_words_and_every_body_an_example(fuzzed: Served) -> None:
    document = fuzzed.get("/openapi.json").json()
    for path, item in document["paths"].items():
        for method, operation in item.items():
            assert operation.get("description") or operation.get("summary"), (method, path)
            for status, answer in operation["responses"].items():
                assert int(status) < 400 or "application/problem+json" in answer["content"] or path == "/readyz", (path, status)
    body = document["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]
    for example in body["examples"].values():
        assert fuzzed.post("/v1/jobs/check", example["value"] | {"until": 0.5}).status_code in (200, 422)
