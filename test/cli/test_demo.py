"""The order of events of `vessel-hsmc demo`, without nodes."""

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import bag_making
import pytest
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.main import cli
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario


def demo(output: Path) -> Result:
    return CliRunner().invoke(cli, ["demo", "--output", str(output)], catch_exceptions=False)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[Scenario]:
    """The scenarios that the command runs; every run becomes a short bag."""
    made: list[Scenario] = []

    def run_nodes(scenario: Scenario, folder: RunFolder, *_: Any, **__: Any) -> scenario_run.Result:
        made.append(scenario)
        folder.write_parameters(scenario)
        bag_making.write_run(folder.bag, 100)
        return scenario_run.Result(folder)

    monkeypatch.setattr(scenario_run, "run_nodes", run_nodes)
    monkeypatch.setattr(scenario_run, "reserve_namespace", lambda *_: nullcontext())
    return made


def test_both_laws_run_in_lockstep_on_the_same_scenario(tmp_path: Path, runs: list[Scenario]) -> None:
    assert demo(tmp_path).exit_code == 0
    assert [scenario.controller.law for scenario in runs] == ["hierarchical", "guided"]
    assert {scenario.name for scenario in runs} == {"case2_tracking"}
    assert all(scenario.controller.lockstep for scenario in runs)


def test_each_run_keeps_a_folder_of_its_own_beside_the_common_page(tmp_path: Path, runs: list[Scenario]) -> None:
    done = demo(tmp_path)
    (folder,) = tmp_path.iterdir()
    assert sorted(path.name for path in folder.iterdir()) == ["figures", "guided", "hierarchical", "report.html"]
    assert f"page: {folder / 'report.html'}" in done.output


def test_a_run_that_fails_ends_the_command_with_its_exit_code(
    tmp_path: Path, runs: list[Scenario], monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(scenario: Scenario, folder: RunFolder, *_: Any, **__: Any) -> scenario_run.Result:
        runs.append(scenario)
        return scenario_run.Result(folder, 130, "interrupted")

    monkeypatch.setattr(scenario_run, "run_nodes", failing)
    assert demo(tmp_path).exit_code == 130
    assert len(runs) == 1


def test_the_sentences_follow_the_table(tmp_path: Path, runs: list[Scenario]) -> None:
    output = demo(tmp_path).output
    places = [output.index(text) for text in ("position error, final", "The paper's law (hierarchical)", "The guided law")]
    assert places == sorted(places)
