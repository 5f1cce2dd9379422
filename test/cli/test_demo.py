"""The order of events of `vessel-hsmc demo`, without nodes."""

import re
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import bag_making
import numpy as np
import pytest
from click.testing import CliRunner, Result
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from unrendered import leave_unrendered

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.report.diagrams import LAW_COLOURS, page_colour, run_colour
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario
from vessel_hsmc_ros.studies import scenario_run
from vessel_hsmc_ros.studies.scenario_run import LAWS


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
        folder.write_parameters(dump_scenario(scenario))
        bag_making.write_run(folder.bag, 100)
        return scenario_run.Result(folder)

    output = tmp_path_factory.mktemp("demo")
    return Demonstration(demo(output, run_nodes), output, scenarios)


@pytest.mark.long
def test_three_laws_run_in_lockstep_on_the_same_scenario(demonstration: Demonstration) -> None:
    assert demonstration.result.exit_code == 0
    scenarios = demonstration.scenarios
    assert [scenario.controller.law for scenario in scenarios] == ["hierarchical", "hierarchical_printed", "guided"]
    assert {scenario.name for scenario in scenarios} == {"case2_tracking"}
    assert all(scenario.controller.lockstep for scenario in scenarios)


def test_each_run_keeps_a_folder_of_its_own_beside_the_common_page(demonstration: Demonstration) -> None:
    (folder,) = demonstration.output.iterdir()
    assert {path.name for path in folder.iterdir()} == {"figures", "report.html", *LAWS}
    assert f"page: {folder / 'report.html'}" in demonstration.result.output


def test_the_sentences_follow_the_table(demonstration: Demonstration) -> None:
    output = demonstration.result.output
    texts = "position error, final", "The paper's law, repaired", "The paper's law as printed", "The guided law"
    places = [output.index(text) for text in texts]
    assert places == sorted(places)


def test_a_law_has_one_colour_in_the_demonstration_and_in_comparisons() -> None:
    """Also in the picture of README, which its command draws."""
    assert {law: page_colour(run_colour(run)) for run, law in enumerate(LAWS)} == {law: LAW_COLOURS[law] for law in LAWS}
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    (laws,) = re.findall(r"`vessel-hsmc compare case2_tracking --laws ([\w,]+)` draws this picture", readme)
    picture = imread(Path(__file__).parents[2] / "docs" / "images" / "compare_case2.png")[..., :3]
    for law in laws.split(","):
        shown = np.abs(picture - to_rgb(LAW_COLOURS[law])).max(axis=2) < 0.02
        assert np.count_nonzero(shown) > 500, law


def test_a_run_that_fails_ends_the_command_with_its_exit_code(tmp_path: Path) -> None:
    scenarios: list[Scenario] = []

    def failing(scenario: Scenario, folder: RunFolder, *_: Any, **__: Any) -> scenario_run.Result:
        scenarios.append(scenario)
        return scenario_run.Result(folder, 130, "interrupted")

    assert demo(tmp_path, failing).exit_code == 130
    assert len(scenarios) == 1
