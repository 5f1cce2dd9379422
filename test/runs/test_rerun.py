"""A recorded scenario repeated with changed parameters."""

from pathlib import Path

import bag_making
import pytest

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.metrics import Metrics, evaluate
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.runs.verification import Rerun, rerun
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario

CHANGE = {"controller.law": "guided"}


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of 1.99 s with the scenario of case 2, which lasts 400 s, beside it."""
    folder = tmp_path_factory.mktemp("run")
    bag_making.write_run(folder / "bag", 200)
    (folder / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking")))
    return folder / "bag"


@pytest.fixture(scope="module")
def repeated(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Rerun:
    return rerun(open_bag(bag), CHANGE, None, tmp_path_factory.mktemp("output"))


def metrics_of(run: Run) -> Metrics:
    return evaluate(run.time, run.state, run.reference, run.wrench)


def test_the_table_has_recorded_and_repeated_values_in_this_order(bag: Path, repeated: Rerun) -> None:
    recorded = metrics_of(open_bag(bag).run())
    again = metrics_of(simulate(load_scenario("case2_tracking", {**CHANGE, "vessel_sim.duration": 1.99})))
    _, first, second, difference = next(line for line in repeated.table if line[0] == "position error, final")
    assert first == quantity(recorded.position_error_final, "m")
    assert second == quantity(again.position_error_final, "m")
    assert difference.startswith(quantity(again.position_error_final - recorded.position_error_final, "m", sign=True))


def test_quantities_that_only_the_recording_has_are_left_out(repeated: Rerun) -> None:
    assert "messages recorded" not in [line[0] for line in repeated.table]


def test_the_repetition_lasts_as_long_as_the_recording(repeated: Rerun) -> None:
    assert load_scenario(repeated.folder.parameters).vessel_sim.duration == pytest.approx(1.99)


def test_page_and_figures_are_in_a_run_folder_of_their_own(repeated: Rerun) -> None:
    assert repeated.change == "controller.law = guided"
    assert "recorded and with controller.law = guided" in repeated.folder.report.read_text()
    assert (repeated.folder.figures / "track.png").exists()
