"""`--set node.param=value`: how its texts are parsed."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.options import checked_namespace, parse_changes
from vessel_hsmc_ros.core.exceptions import ParameterError


def test_values_are_yaml_with_the_numbers_of_ros_files() -> None:
    changes = parse_changes(["a.x=1e5", "a.list=[1, 2.5]", "a.flag=false", "a.text=guided"])
    assert changes == {"a.x": 1e5, "a.list": [1, 2.5], "a.flag": False, "a.text": "guided"}


def test_a_value_may_contain_equals_signs() -> None:
    assert parse_changes(["recorder.regex=a=b=c"]) == {"recorder.regex": "a=b=c"}


def test_the_last_of_several_values_counts() -> None:
    assert parse_changes(["a.x=1", "a.x=2"]) == {"a.x": 2}


def test_of_a_file_and_a_value_the_later_one_counts(tmp_path: Path) -> None:
    path = tmp_path / "own.yaml"
    path.write_text("vessel_sim:\n  ros__parameters:\n    duration: 7.0\n", encoding="utf-8")
    name = "vessel_sim.duration"
    assert parse_changes([f"@{path}", f"{name}=3"])[name] == 3
    assert parse_changes([f"{name}=3", f"@{path}"])[name] == 7.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("vessel_sim.duration", "--set must be node.param=value.*got vessel_sim.duration"),
        ("a.x=", r"--set must have a value after the equals sign, .*got a\.x="),
        ("a.x=[1", r"--set must have a YAML value after the equals sign \(got a\.x=\[1\)"),
    ],
)
def test_a_malformed_change_is_refused(text: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_changes([text])


@pytest.mark.parametrize("text", ["fleet/alpha", "/fleet/alpha", "fleet/alpha/", "/fleet/alpha/"])
def test_a_namespace_is_taken_with_and_without_slashes_at_its_ends(text: str) -> None:
    assert checked_namespace(text) == "fleet/alpha"


@pytest.mark.long
def test_a_value_without_effect_on_the_scenario_is_warned_of() -> None:
    done = CliRunner().invoke(cli, ["gains", "case2_tracking", "--set", "reference_ship.circle.radius=9.0"])
    assert "reference_ship.circle.radius is given and has no effect: reference_ship.mode is not circle" in done.output
    assert done.output.count("no effect") == 1
