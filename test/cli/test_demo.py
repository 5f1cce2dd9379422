"""The order of events of `vessel-hsmc demo`, without nodes."""

from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import bag_making
import pytest
from click.testing import CliRunner, Result
from unrendered import leave_unrendered

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.runs import scenario_run
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario


class Demonstration(NamedTuple):
    """A finished `vessel-hsmc demo` whose runs were short bags."""

    result: Result
    output: Path
    scenarios: list[Scenario]


def demo(output: Path, run_nodes: Any) -> Result:
    with pytest.MonkeyPatch.context() as patch:
        leave_unrendered(patch)
        patch.setattr(scenario_run, "run_nodes", run_nodes)
        patch.setattr(scenario_run, "reserve_namespace", lambda *_: nullcontext())
        return CliRunner().invoke(cli, ["demo", "--output", str(output)], catch_exceptions=False)


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory: pytest.TempPathFactory) -> Demonstration:
    scenarios: list[Scenario] = []

    def run_nodes(scenario: Scenario, folder: RunFolder, *_: Any, **__: Any) -> scenario_run.Result:
        scenarios.append(scenario)
        folder.write_parameters(scenario)
        bag_making.write_run(folder.bag, 100)
        return scenario_run.Result(folder)

    output = tmp_path_factory.mktemp("demo")
    return Demonstration(demo(output, run_nodes), output, scenarios)


def test_both_laws_run_in_lockstep_on_the_same_scenario(demonstration: Demonstration) -> None:
    assert demonstration.result.exit_code == 0
    scenarios = demonstration.scenarios
    assert [scenario.controller.law for scenario in scenarios] == ["hierarchical_printed", "guided"]
    assert {scenario.name for scenario in scenarios} == {"case2_tracking"}
    assert all(scenario.controller.lockstep for scenario in scenarios)


def test_each_run_keeps_a_folder_of_its_own_beside_the_common_page(demonstration: Demonstration) -> None:
    (folder,) = demonstration.output.iterdir()
    assert sorted(path.name for path in folder.iterdir()) == ["figures", "guided", "hierarchical_printed", "report.html"]
    assert f"page: {folder / 'report.html'}" in demonstration.result.output


def test_the_sentences_follow_the_table(demonstration: Demonstration) -> None:
    output = demonstration.result.output
    places = [output.index(text) for text in ("position error, final", "The paper's law (hierarchical)", "The guided law")]
    assert places == sorted(places)


def test_a_run_that_fails_ends_the_command_with_its_exit_code(tmp_path: Path) -> None:
    scenarios: list[Scenario] = []

    def failing(scenario: Scenario, folder: RunFolder, *_: Any, **__: Any) -> scenario_run.Result:
        scenarios.append(scenario)
        return scenario_run.Result(folder, 130, "interrupted")

    assert demo(tmp_path, failing).exit_code == 130
    assert len(scenarios) == 1
