"""A recorded scenario repeated with changed parameters."""

from pathlib import Path

import bag_making
import pytest
import yaml
from click.testing import CliRunner
from durations import rest_long
from unrendered import leave_unrendered

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import PARAMETERS, BagWriter
from vessel_hsmc_ros.cli.recordings import replay
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.metrics import Metrics, Run, evaluate
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario, load_scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies import verification
from vessel_hsmc_ros.studies.verification import Rerun, rerun

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
    with pytest.MonkeyPatch.context() as patch:
        leave_unrendered(patch)
        return rerun(open_bag(bag), CHANGE, None, tmp_path_factory.mktemp("output"))


def metrics_of(run: Run) -> Metrics:
    return evaluate(run.time, run.state, run.reference, run.wrench)


@pytest.mark.long
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


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of two vessels, with the parameters of their nodes: they start at other places, and have other laws."""
    writer = BagWriter(tmp_path_factory.mktemp("fleet") / "bag")
    document = {}
    for vessel, x, law in (("alpha", 1.0, "guided"), ("beta", 2.0, "los_pid")):
        scenario = load_scenario("case2_tracking", {"vessel_sim.initial_pose": [x, 0.0, 0.0], "controller.law": law})
        for node, content in yaml.safe_load(dump_scenario(scenario)).items():
            document[f"/{vessel}/{node.rpartition('/')[2]}"] = content
    writer.attach(PARAMETERS, yaml.safe_dump(document))
    for vessel in ("alpha", "beta"):
        bag_making.write_run(None, 200, namespace=f"/{vessel}/", close=vessel == "beta", writer=writer)
    return writer.directory


@pytest.mark.parametrize(("vessel", "x"), rest_long([("alpha", 1.0), ("beta", 2.0)]))
def test_of_two_vessels_the_one_that_is_chosen_is_repeated(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, vessel: str, x: float
) -> None:
    for name in ("report.write", "report.figures.draw"):  # the page of another run is looked at above
        monkeypatch.setattr(f"vessel_hsmc_ros.{name}", lambda *_: None)
    again = rerun(open_bag(fleet), {"vessel_sim.seed": 5}, vessel, tmp_path)
    assert load_scenario(str(again.folder.parameters)).vessel_sim.initial_pose[0] == x


@pytest.mark.parametrize(("vessel", "law"), [("alpha", "guided"), ("beta", "los_pid")])
def test_of_two_vessels_the_commands_of_the_one_that_is_chosen_are_recomputed(
    fleet: Path, monkeypatch: pytest.MonkeyPatch, vessel: str, law: str
) -> None:
    chosen: list[str] = []

    def noting(_bag: object, scenario: Scenario, _namespace: object) -> None:
        chosen.append(scenario.controller.law)
        raise BagError("enough")

    monkeypatch.setattr(verification, "verify", noting)
    assert isinstance(CliRunner().invoke(replay, [str(fleet), "--verify", "--namespace", vessel]).exception, BagError)
    assert chosen == [law]
