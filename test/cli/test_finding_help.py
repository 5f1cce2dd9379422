"""What a newcomer looks for, the command answers: whole help texts, the nearest name, lists of scenarios and parameters."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import GROUPS, VERBS, cli
from vessel_hsmc_ros.cli.listing import matching
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.parameters import FIRST, NODES, WATCHERS
from vessel_hsmc_ros.scenario.scenario import load_scenario, scenario_names


def invoke(*arguments: str, **environment: str) -> Result:
    return CliRunner().invoke(cli, arguments, prog_name="vessel-hsmc", env={"COLUMNS": "80", **environment})


def test_the_help_names_every_verb_in_a_group_with_a_whole_line() -> None:
    shown = invoke("--help").output
    assert all(f"\n{group}:\n" in shown for group in GROUPS)
    assert all(line in shown for line in VERBS.values())
    assert "..." not in shown.partition("Options:")[2]
    assert max(map(len, shown.splitlines())) <= 80


@pytest.mark.parametrize("verb", VERBS)
def test_the_help_of_every_verb_is_whole_in_80_columns(verb: str) -> None:
    result = invoke(verb, "--help")
    assert result.exit_code == 0
    options = result.output.partition("Options:")[2]
    assert max(map(len, options.splitlines())) <= 80


def test_of_an_unknown_verb_the_nearest_is_named() -> None:
    result = invoke("simulte", "case2_tracking")
    assert result.exit_code == 2
    assert "did you mean simulate?" in result.output


def test_of_an_unknown_scenario_the_nearest_is_named_also_if_it_is_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cat25.yaml").touch()
    for name, meant in (("cat25", "./cat25.yaml"), ("cat52.yaml", "./cat25.yaml"), ("case2_trakcing", "case2_tracking")):
        with pytest.raises(ScenarioError, match=rf"did you mean {meant}\?"):
            load_scenario(name)
    with pytest.raises(ScenarioError) as unlike:
        load_scenario("zzz")
    assert "did you mean" not in str(unlike.value)


@pytest.mark.long
def test_scenarios_are_listed_for_people_and_programs_and_printed_to_start_from() -> None:
    assert all(name in invoke("scenarios").output for name in scenario_names())
    listed = json.loads(invoke("scenarios", "--json").output)
    assert [each["name"] for each in listed] == scenario_names()
    assert all(each["about"] for each in listed)
    assert "ros__parameters" in invoke("scenarios", "goal").output


def test_a_word_finds_the_parameters_in_whose_name_or_meaning_it_occurs() -> None:
    names = {each["name"] for each in json.loads(invoke("parameters", "Dead", "--json").output)}
    assert "controller.vessel.surge_dead_time" in names
    assert "controller.vessel.surge_dead_time = -1" in invoke("parameters", "dead_time").output
    with pytest.raises(ParameterError, match="no parameter has zzz in its name or meaning"):
        cli(["parameters", "zzz"], standalone_mode=False)


def test_a_word_is_found_in_names_and_meanings_whatever_its_case() -> None:
    named = [record["name"] for record in matching("heartbeat_TIMEOUT")]
    assert named == ["watchdog.heartbeat_timeout", "mavlink.heartbeat_timeout", "px4.heartbeat_timeout"]
    assert [record["name"] for record in matching("WatchDog.Ramp")] == ["watchdog.ramp_time"]
    for word in ("vehiclestatus", "pierson"):
        assert matching(word) == matching(word.upper()) != []
    declared = [f"{node}.{name}" for node, cls in (NODES | WATCHERS).items() for name in schema.entries(cls)]
    listed = [record["name"] for record in matching("")]
    assert listed == [*FIRST, *(name for name in declared if name not in FIRST)], "those that an owner sets come first"


def test_all_parameters_are_given_to_programs_as_valid_json() -> None:
    def refuse(constant: str) -> None:
        raise ValueError(constant)

    assert len(json.loads(invoke("parameters", "--json").output, parse_constant=refuse)) > 100


def test_vessels_and_gains_are_given_to_programs_in_numbers() -> None:
    listed = json.loads(invoke("vessels", "--json").output)
    assert {"otter", "cybership2"} <= {each["key"] for each in listed}
    assert json.loads(invoke("vessels", "otter", "--json").output)["values"]["vessel.length"] == 2.0
    found = json.loads(invoke("gains", "case2_tracking", "--set", "controller.law=los_pid", "--json").output)
    assert found["gains"]["yaw_bandwidth"] > 0.0
    assert all(loop["stable"] for loop in found["margins"].values())


def test_the_shell_is_offered_verbs_and_scenarios() -> None:
    words = {"_VESSEL_HSMC_COMPLETE": "bash_complete", "COMP_WORDS": "vessel-hsmc simulate case3", "COMP_CWORD": "2"}
    assert "plain,case3_stabilisation" in invoke(**words).output
    assert "plain,simulate" in invoke(**words | {"COMP_WORDS": "vessel-hsmc sim", "COMP_CWORD": "1"}).output
