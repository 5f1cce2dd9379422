"""The page of promises: generated from the declarations, complete, and each row held by tests that exist."""

import re
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.safety.reasons import Reason
from vessel_hsmc_ros.scenario.parameter_page import held_by, safety_page, with_defaults
from vessel_hsmc_ros.scenario.promises import PROMISES, REMEDIES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")


def test_the_generated_parts_of_the_page_are_those_of_the_declarations() -> None:
    assert safety_page(PAGE) == PAGE, "run `make docs`"
    assert re.findall(r"<!-- generated: (\w+) -->", PAGE) == ["promises", "reasons", "tests"]


@pytest.mark.parametrize("test", held_by())
def test_the_tests_that_hold_a_promise_exist(test: str) -> None:
    path, name = test.split("::")
    text = (ROOT / "test" / path).read_text(encoding="utf-8")
    assert re.search(rf"^(async )?def {name}\(", text, re.MULTILINE), test


def test_every_promise_is_held_by_a_test_and_has_a_reason() -> None:
    assert all(promise.tests and promise.reasons for promise in PROMISES)


def test_every_reason_has_a_row_and_a_remedy_where_there_is_something_to_do() -> None:
    assert set(REMEDIES) == set(Reason)
    assert {reason for reason, remedy in REMEDIES.items() if not remedy} == {Reason.NONE, Reason.SHUTTING_DOWN, Reason.HANDOVER}
    promised = {reason for promise in PROMISES for reason in promise.reasons}
    assert set(Reason) - promised == {Reason.NONE}


def test_defaults_are_read_from_the_declarations() -> None:
    assert with_defaults("after {controller.input_timeout}") == "after 0.5 s (`controller.input_timeout`)"
    with pytest.raises(KeyError):
        with_defaults("{controller.no_such_parameter}")


def test_an_unknown_generated_part_is_refused() -> None:
    with pytest.raises(ScenarioError, match="generated part nothing is unknown: it takes one of promises, reasons, tests"):
        safety_page("<!-- generated: nothing -->\n<!-- end -->")
