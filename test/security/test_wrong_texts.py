"""Texts and bytes that are wrong are refused by one line."""

from typing import Any

import hypothesis.strategies as st
import pytest
import yaml
from hypothesis import given

from vessel_hsmc_ros.bags.mcap_contents import chunk_records
from vessel_hsmc_ros.bags.topic_columns import read_definition
from vessel_hsmc_ros.core.exceptions import BagError, VesselHsmcError
from vessel_hsmc_ros.scenario.parameters_file import read_yaml


@pytest.mark.parametrize(
    "text",
    [
        "!!int ''",
        "!!python/object/apply:os.system [id]",
        "9" * 5000,
    ],
)
def test_yaml_that_has_no_value_is_refused(text: str) -> None:
    with pytest.raises(yaml.YAMLError):
        read_yaml(text)


def test_a_key_given_twice_is_refused() -> None:
    with pytest.raises(yaml.YAMLError, match="given twice"):
        read_yaml("{'': 1, '': 2}")


def test_an_alias_that_stands_for_a_value_is_read() -> None:
    assert read_yaml("{a: &a [1, 2], b: *a}") == {"a": [1, 2], "b": [1, 2]}


@given(
    st.recursive(
        st.integers() | st.text("abc"),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text("abc"), inner, max_size=4),
    )
)
def test_any_value_with_aliases_is_read_as_it_was_written(value: Any) -> None:
    assert read_yaml(yaml.safe_dump([value, value])) == [value, value]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("B a\n", "missing"),
        ("string x\nimport os; os.system('id')\n", "cannot be read"),
    ],
)
def test_a_definition_of_a_message_that_cannot_be_read_is_refused(text: str, why: str) -> None:
    with pytest.raises(BagError, match=why):
        read_definition("x/msg/A", text)


def test_a_record_that_ends_behind_its_chunk_is_refused() -> None:
    with pytest.raises(ValueError, match="cut off"):
        chunk_records(b"\x07" + (1 << 40).to_bytes(8, "little"))


def test_an_error_is_one_printable_line_of_limited_length() -> None:
    text = str(VesselHsmcError("\x1b[31m a\nb" + "c" * 10_000))
    assert text.isprintable()
    assert len(text) < 5000
