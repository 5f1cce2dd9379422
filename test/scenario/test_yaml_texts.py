"""Tests of the YAML that the package writes: ROS, rosbag2 and the package itself read back what was written."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from vessel_hsmc_ros.scenario.parameters_file import read_yaml, yaml_text

SCALARS = (
    st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=8)
    | st.text("0123456789.eExX+-_:~yYnN<=&*", max_size=6)
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
)


@given(SCALARS)
@example("1e5")
@example("1e+5")
@example("y")
@example("n")
@example("nan")
@example("-inf")
@example("Infinity")
@example("017")
def test_a_value_is_read_back_as_it_was_written(value: object) -> None:
    read = read_yaml(yaml_text({"name": value, "list": [value]}))
    assert read == {"name": value, "list": [value]}
    assert type(read["name"]) is type(value)


@pytest.mark.parametrize("key", ["y", "on", "1e5", "null", "=", "nan"])
def test_a_name_stays_a_text(key: str) -> None:
    assert read_yaml(yaml_text({key: 1})) == {key: 1}


def test_an_object_that_occurs_twice_is_written_twice() -> None:
    shared = {"sec": 1, "points": [0.0, 1.0]}
    text = yaml_text({"a": shared, "b": shared})
    assert "&" not in text
    assert "*" not in text
    assert read_yaml(text) == {"a": shared, "b": shared}
