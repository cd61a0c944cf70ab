"""Control characters in the text of one user cannot control the terminals of other users. These characters cannot reverse the text
direction of pages, either."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from tests.service.store.test_store_contract import submitted
from trunnion.basics.control_characters import visible
from trunnion.cli import main
from trunnion.service.api.documents.job_document import job_document
from trunnion.service.request_models.base_model_and_studies import PlainText, Tag
from trunnion.service.store.leases_and_chunks import WorkStore

HOSTILE = ["\x1b[2J", "\x7f", "\x9b31m", "a\nb", "\u202egnp.exe", "\u2066x", "\u200fx", "\u061cx", "a\u2028b"]


@pytest.mark.parametrize("text", HOSTILE)
def test_labels_tags_and_names_hold_no_control_characters(text: str, tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    for kind in (PlainText, Tag):
        with pytest.raises(ValidationError):
            TypeAdapter(kind).validate_python(text)
    assert main(["serve", "--data", str(tmp_path / "none"), "--new-key", f"{text}:read"]) == 2
    assert not (tmp_path / "none").exists()
    assert visible(text).isascii()
    assert visible(text).isprintable()


def test_text_that_people_write_is_kept() -> None:
    for text in ("Führung, zweiter Versuch", "шарнир", "מסבך", "試験", "a\u00a0b", "👩\u200d🔬 ☃"):
        assert TypeAdapter(PlainText).validate_python(text) == text == visible(text)


def test_control_characters_stored_by_an_earlier_version_are_shown_as_escapes(tmp_path: Any) -> None:
    store = WorkStore(f"sqlite:///{tmp_path / 'store.db'}")
    store.upgrade()
    job = replace(submitted(store), label="\x1b[2Jlabel", scene="\u202escene", tags=["\x9btag"])
    told = job_document(job)
    assert (told["label"], told["scene"], told["tags"]) == ("\\u001b[2Jlabel", "\\u202escene", ["\\u009btag"])
    store.close()
