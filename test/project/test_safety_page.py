"""The page of guarantees: generated from the declarations, complete, and each row held by tests that exist."""

import re
from pathlib import Path

import pytest
from guarantees import GUARANTEES
from pages import held_by, with_defaults, with_tables
from remedies import REMEDIES

from vessel_hsmc_ros.control.safety.parameters import Reason

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")


def test_the_generated_parts_of_the_page_are_those_of_the_declarations() -> None:
    assert with_tables(PAGE) == PAGE, "run `make docs`"
    assert re.findall(r"<!-- generated: (\w+) -->", PAGE) == ["guarantees", "reasons", "tests"]


@pytest.mark.parametrize("test", held_by())
def test_the_tests_that_hold_a_guarantee_exist(test: str) -> None:
    path, name = test.split("::")
    text = (ROOT / "test" / path).read_text(encoding="utf-8")
    assert re.search(rf"^(async )?def {name}\(", text, re.MULTILINE), test


def test_every_guarantee_is_held_by_a_test_and_has_a_reason() -> None:
    assert all(guarantee.tests and guarantee.reasons for guarantee in GUARANTEES)


def test_every_reason_has_a_row_and_a_remedy_where_there_is_something_to_do() -> None:
    assert set(REMEDIES) == set(Reason)
    assert {reason for reason, remedy in REMEDIES.items() if not remedy} == {Reason.NONE, Reason.SHUTTING_DOWN, Reason.HANDOVER}
    guaranteed = {reason for guarantee in GUARANTEES for reason in guarantee.reasons}
    assert set(Reason) - guaranteed == {Reason.NONE}


def test_defaults_are_read_from_the_declarations() -> None:
    assert with_defaults("after {controller.input_timeout}") == "after 0.5 s (`controller.input_timeout`)"
    with pytest.raises(KeyError):
        with_defaults("{controller.no_such_parameter}")
