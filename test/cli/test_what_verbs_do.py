"""What verbs do with the values that have arrived: exit codes, folders, held-out runs, gains, all of unlike values."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from click.testing import CliRunner

from vessel_hsmc_ros.cli import gains, run
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.options import compare_with_row
from vessel_hsmc_ros.control.loop.linearised_law import Margins
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario import own_ship
from vessel_hsmc_ros.scenario.run_folder import RunFolder
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.identification import study
from vessel_hsmc_ros.studies.scenario_run import Result
from vessel_hsmc_ros.studies.tuning.plan import Case

METRICS = Metrics(*[float(number) for number in range(1, len(Metrics._fields) + 1)])


@pytest.fixture
def fleets(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Any]:
    """The fleets that `run` would start; the first entry is the result that it gets."""
    given: list[Any] = [Result(RunFolder(tmp_path / "made"))]

    def start(fleet: Any, folder: RunFolder, *_: Any) -> Result:
        given.extend([fleet, folder])
        return given[0]  # type: ignore[no-any-return]

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run, "reserve_namespaces", lambda _: nullcontext())
    monkeypatch.setattr(run, "run_fleet", start)
    return given


@pytest.mark.parametrize(("code", "failure"), [(0, ""), (1, "vessel_2/controller failed"), (130, "interrupted by SIGINT")])
def test_the_exit_code_of_a_fleet_is_that_of_its_run(fleets: list[Any], code: int, failure: str) -> None:
    fleets[0].exit_code, fleets[0].failure = code, failure
    done = CliRunner().invoke(cli, ["run", "case2_straight", "--vessels", "2", "--output", "there"])
    assert done.exit_code == code
    assert (f"error: {failure}" in done.output) == (code == 1)
    assert ("\ninterrupted\n" in f"\n{done.output}") == (code == 130)
    assert fleets[2].path.parent == Path("there")


def test_each_vessel_of_a_fleet_has_a_frame_and_a_line_of_its_own(fleets: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    slow = METRICS._replace(position_error_rms=250.0, position_error_final=37.0)
    fleets[0].records = [
        SimpleNamespace(name="boat_1", metrics=METRICS._replace(position_error_rms=1.5), facts={"missed_periods": 3}),
        SimpleNamespace(name="boat_2", metrics=slow, facts={"missed_periods": 4, "messages_recorded": 77}),
    ]
    tables: list[Any] = []
    monkeypatch.setattr(run, "print_table", lambda *given: tables.extend(given))
    arguments = "--vessels", "2", "--spacing", "-7", "--namespace", "/boat/", "--set", "vessel_sim.seed=11"
    CliRunner().invoke(cli, ["run", "case2_straight", *arguments], catch_exceptions=False)
    fleet = fleets[1]
    prefixes = {name: scenario.controller.frame_prefix for name, scenario in fleet.vessels.items()}
    assert prefixes == {"boat_1": "boat_1/", "boat_2": "boat_2/"}
    assert fleet.base.recorder.frame_prefix == ""  # one recorder for all
    assert [scenario.vessel_sim.seed for scenario in fleet.vessels.values()] == [11, 12]
    head, rows = tables
    found = [dict(zip(head, row, strict=True)) for row in rows]
    assert [row["vessel"] for row in found] == ["boat_1", "boat_2"]
    texts = [[text for text in row.values() if text] for row in found]
    assert "1.5 m" in texts[0]
    assert "3" in texts[0]
    assert {"250 m", "37 m", "4", "77"} <= set(texts[1])
    assert "77" not in texts[0]


def test_what_is_set_by_hand_takes_precedence_over_what_a_verb_sets(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    given: list[Any] = []

    def run_nodes(*arguments: Any, **_: Any) -> None:
        given.extend(arguments)
        raise click.Abort

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.reserve_namespace", lambda *_: nullcontext())
    monkeypatch.setattr("vessel_hsmc_ros.studies.scenario_run.run_nodes", run_nodes)
    own = "--namespace", "boat", "--set", "controller.frame_prefix=mine/"
    CliRunner().invoke(cli, ["run", "case2_straight", *own], standalone_mode=False)
    scenario, _, namespace, *_ = given
    prefixes = scenario.controller.frame_prefix, scenario.vessel_sim.frame_prefix
    assert (*prefixes, namespace) == ("mine/", "boat/", "boat")


@pytest.mark.parametrize("option", [["--campaign", "x", "--run", "3"], ["--faults", "x.yaml"], ["--live"]])
def test_a_fleet_takes_none_of_the_options_of_one_vessel(fleets: list[Any], option: list[str]) -> None:
    scenario = [] if "--campaign" in option else ["case2_straight"]
    done = CliRunner().invoke(cli, ["run", *scenario, "--vessels", "2", *option], standalone_mode=False)
    assert isinstance(done.exception, click.UsageError)
    assert len(fleets) == 1


@pytest.mark.parametrize("option", [["--real-time"], ["--set", "vessel_sim.seed=1"], ["--faults", "x.yaml"], ["case2_tracking"]])
def test_a_row_of_a_campaign_is_repeated_as_it_is(option: list[str]) -> None:
    done = CliRunner().invoke(cli, ["run", "--campaign", "folder", "--run", "3", *option], standalone_mode=False)
    assert isinstance(done.exception, click.UsageError)


def test_a_failed_run_that_differs_from_its_row_differs(capsys: pytest.CaptureFixture[str]) -> None:
    row: Any = SimpleNamespace(run=7, values={"ended_early": True}, differences=lambda *_: ["it differs"])
    failed: Any = SimpleNamespace(metrics=None, failure="failure", exit_code=1)
    assert compare_with_row(row, failed) == 1
    row.differences = lambda *_: []
    assert compare_with_row(row, failed) == 0  # the row has failed in the same way
    assert "the run ended early as row 7 of the campaign" in capsys.readouterr().out


@pytest.fixture
def campaigns(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[dict[str, Any]]:
    """The calls that `campaign` makes in place of computing."""
    calls: list[dict[str, Any]] = []
    monkeypatch.chdir(tmp_path)

    def run_campaign(file: str, folder: Path, **named: Any) -> None:
        calls.append({"file": file, "folder": folder, **named})

    monkeypatch.setattr("vessel_hsmc_ros.studies.campaign.execute.run_campaign", run_campaign)
    return calls


def test_a_campaign_states_the_folder_and_the_number_of_its_runs(campaigns: list[dict[str, Any]], tmp_path: Path) -> None:
    text = "scenario: case2_tracking\nlaws: [guided, los_pid]\nruns: 40\ndraw:\n  vessel_sim.seed: {choice: [1, 2]}\n"
    (tmp_path / "mine.yaml").write_text(text)
    done = CliRunner().invoke(cli, ["campaign", "mine.yaml", "--runs", "12"], catch_exceptions=False)
    folder = Path("runs") / "mine_campaign"
    assert campaigns[0]["folder"] == folder
    assert f"24 runs: {folder}" in done.output
    assert f"vessel-hsmc campaign report {folder}" in done.output


def test_a_campaign_goes_on_in_the_folder_that_is_given_as_its_file(
    campaigns: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "older").mkdir()
    given: list[Any] = []

    def load(*arguments: Any) -> Any:
        given.extend(arguments)
        return SimpleNamespace(name="other", runs=9, notes=["a note"])

    monkeypatch.setattr("vessel_hsmc_ros.studies.campaign.plan.Campaign.load", load)
    done = CliRunner().invoke(cli, ["campaign", "older", "--runs", "30"], catch_exceptions=False)
    assert given == ["older", 30, None]
    assert (campaigns[0]["file"], campaigns[0]["folder"], campaigns[0]["runs"]) == ("older", Path("older"), 30)
    assert "9 runs: older" in done.output
    assert "a note" in done.output


@pytest.mark.parametrize("held_out", [None, "case2_slalom"])
def test_a_tuning_is_judged_on_other_runs_with_the_same_changes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, held_out: str | None
) -> None:
    monkeypatch.chdir(tmp_path)
    given: dict[str, Any] = {}

    def held_out_cases(source: str, changes: Any, law: str, others: bool) -> list[Case]:
        given.update(source=source, changes=changes, law=law, others=others)
        return [Case("unseen", load_scenario("case2_tracking"))]

    def tune(*arguments: Any) -> None:
        given.update(arguments=arguments)
        raise click.Abort

    monkeypatch.setattr("vessel_hsmc_ros.studies.tuning.plan.held_out_cases", held_out_cases)
    monkeypatch.setattr("vessel_hsmc_ros.studies.tuning.result.tune", tune)
    arguments = "--law", "los_pid", "--gain", "controller.los_pid.surge_gain=0.1:0.4", "--set", "vessel_sim.duration=2.5"
    chosen = ("--held-out", held_out) if held_out else ()
    CliRunner().invoke(cli, ["tune", "case2_tracking", *arguments, *chosen, "--output", "there"], standalone_mode=False)
    expected = {
        "source": held_out or "case2_tracking",
        "changes": {"vessel_sim.duration": 2.5},
        "law": "los_pid",
        "others": held_out is not None,
    }
    assert {name: given[name] for name in expected} == expected
    tuning, folder, trials, unseen, _ = given["arguments"]
    assert (tuning.seed, tuning.workers, folder, trials) == (1, None, Path("there"), 100)
    assert [case.name for case in unseen] == ["unseen"]


def test_every_run_of_an_identification_is_read_with_the_same_columns_and_topics(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    read: list[Any] = []
    monkeypatch.setattr(study, "measured", lambda *given: read.append(given))

    def estimate(*_: Any) -> None:
        raise click.Abort

    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.estimate.identify", estimate)
    options = "--held-out", "c.csv", "--held-out", "d", "--column", "x=east", "--namespace", "boat"
    topics = "--odometry", "/state", "--wrench", "/thrust"
    CliRunner().invoke(cli, ["identify", "a.csv", "b", *options, *topics], standalone_mode=False)
    named = {"namespace": "boat", "odometry": "/state", "wrench": "/thrust"}
    assert read == [(Path(name), {"x": "east"}, named) for name in ("a.csv", "b", "c.csv", "d")]


def test_a_held_out_run_is_predicted_by_the_identified_ship_and_by_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    predicted: list[Any] = []

    def predict(values: Any, measured: str, window: float, inputs: Any = None) -> str:
        predicted.append((dict(values), measured, window, inputs))
        return f"prediction {len(predicted)}"

    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.types.predict", predict)
    monkeypatch.setattr("vessel_hsmc_ros.studies.identification.page.steady_load", lambda *given: given)
    monkeypatch.setattr(own_ship, "ship_of", lambda values: values)
    monkeypatch.setattr("vessel_hsmc_ros.core.schema.flatten", lambda values: values)
    found: Any = SimpleNamespace(values={"a": 1.5, "b": 2.5}, inputs={"gain": 0.75})
    start: Any = SimpleNamespace(values={"a": 11.0, "b": 12.0, "name": "ship"})
    runs: Any = ["one", "two"]
    judged: Any = study.judged(runs, found, start, 7.5)
    new, old = {"a": 1.5, "b": 2.5}, {"a": 11.0, "b": 12.0}
    assert predicted == [call for name in runs for call in ((new, name, 7.5, {"gain": 0.75}), (old, name, 7.5, None))]
    assert [(each.run, each.prediction, each.before) for each in judged] == [
        ("one", "prediction 1", "prediction 2"),
        ("two", "prediction 3", "prediction 4"),
    ]
    assert [each.load for each in judged] == [(new, name, 7.5, {"gain": 0.75}) for name in runs]
    assert [each.before for each in study.judged(runs, found, None, 7.5)] == [None, None]


def test_gains_for_programs_are_those_in_use_beside_margins_by_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    loops = {"one": Margins(True, 6.5, 40.5, 1.5, 0.25), "two": Margins(False, 7.5, 50.5, 2.5, 0.75)}
    monkeypatch.setattr(gains, "shortcomings", lambda *_: ["a warning"])
    for law in ("guided", "los_pid"):
        scenario = load_scenario("case2_tracking", {"controller.law": law})
        content = gains._content(scenario, SimpleNamespace(loops=loops))  # type: ignore[arg-type]
        own = getattr(scenario.controller, law)
        assert content["law"] == law
        assert content["gains"] == {name: getattr(own, name) for name in content["gains"]}
        assert {margins["gain_db"] for margins in content["margins"].values()} == {6.5, 7.5}
        assert content["margins"]["two"] == {"stable": False, "gain_db": 7.5, "phase_deg": 50.5, "delay": 2.5, "crossover": 0.75}
        assert content["warnings"] == ["a warning"]
