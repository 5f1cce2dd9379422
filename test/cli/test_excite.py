import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.boats.parameters import commands, interfaces
from vessel_hsmc_ros.cli import console
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.scenario import load_scenario


def call(*arguments: object) -> str:
    return CliRunner().invoke(cli, [*map(str, arguments)], standalone_mode=False, catch_exceptions=False).output


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_excite_writes_manoeuvres_for_a_vessel_and_names_time_and_space() -> None:
    output = call("excite", "otter")
    assert "turns on the spot" in output
    assert "they take " in output
    assert load_scenario("otter_excite.yaml").controller.law == "open_loop"
    with pytest.raises(ScenarioError, match=r"otter_excite\.yaml exists and is not overwritten"):
        call("excite", "otter")


def test_excite_takes_the_scenario_of_a_ship_of_ones_own() -> None:
    call("init", "mine", "--length", "3", "--no-check")
    call("excite", "mine.yaml", "--file", "sail.yaml")
    mine, sail = (load_scenario(name).vessel_sim.vessel for name in ("mine.yaml", "sail.yaml"))
    assert sail == mine


def test_excite_names_a_ship_that_does_not_exist_in_one_line() -> None:
    with pytest.raises(ScenarioError, match=r"yacht is neither a vessel nor a scenario: it must be one of .*otter.*, or a file"):
        call("excite", "yacht")
    with pytest.raises(ScenarioError, match=r"scenario file nowhere\.yaml does not exist"):
        call("excite", "nowhere.yaml")


@pytest.mark.parametrize("name", ["my boat.yaml", "boat's.yaml", "$HOME & co.yaml"])
def test_the_next_command_can_be_pasted_whatever_the_name_of_the_file(name: str) -> None:
    output = call("excite", "otter", "--file", name)
    command = output[output.index("vessel-hsmc simulate") :].partition(", or sail it")[0]
    assert shlex.split(command) == ["vessel-hsmc", "simulate", name]


@pytest.mark.parametrize("name", ["my runs", "o'clock", "a;b"])
def test_the_command_that_continues_from_a_failed_run_can_be_pasted(tmp_path: Path, name: str) -> None:
    bag = tmp_path / name
    BagWriter(bag).close()
    command = console._what_remains(bag).partition(": ")[2]
    assert shlex.split(command) == ["vessel-hsmc", "report", str(bag)]


def test_the_start_of_the_nodes_of_a_stack_can_be_pasted() -> None:
    for line in commands(interfaces()["heron"], "my boat"):
        assert "my boat.yaml" in shlex.split(line)
        assert "my boat_heron.yaml" in shlex.split(line)
