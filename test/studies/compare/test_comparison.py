"""`vessel-hsmc compare`: its runs, its metrics, its files."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click import UsageError
from click.testing import CliRunner, Result
from rich.console import Console
from unrendered import leave_unrendered

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.comparing import coloured
from vessel_hsmc_ros.cli.console import print_table
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core.exceptions import BagError, ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies import comparison
from vessel_hsmc_ros.studies.comparison import LawMetrics, LawRun, Task, compare, default_laws, prepare, run_task
from vessel_hsmc_ros.studies.scenario_run import run_offline
from vessel_hsmc_ros.studies.suite import Row

SHORT = {"vessel_sim.duration": 2.0}
ROW = Row("circle", changes=SHORT, at_most=100.0)


def vessel_hsmc(*arguments: str) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, ["compare", *arguments], catch_exceptions=False, standalone_mode=False)


def test_the_default_laws_track_a_position_and_are_installed() -> None:
    laws = default_laws()
    assert {"hierarchical_printed", "los_pid"} <= set(laws) <= set(LAWS)
    assert not {"course", "pd"} & set(laws)


def test_the_requested_rate_is_that_of_the_law() -> None:
    assert prepare(Task(ROW, "los_pid", 20.0))[0].controller.rate_hz == 20.0
    assert prepare(Task(ROW, "los_pid", None))[0].controller.rate_hz == 100.0


def test_a_law_that_is_unstable_at_the_requested_rate_runs_at_100_hz_with_a_note() -> None:
    outcome = run_task(Task(ROW, "hierarchical_printed", 50.0))
    assert outcome.rate_hz == 100.0
    assert comparison.notes([outcome]) == ["hierarchical_printed is unstable at the requested rate and ran at 100 Hz"]


def test_a_law_at_100_hz_instead_of_its_rate_has_the_changes_of_its_row() -> None:
    own = Row(
        "circle", changes={"vessel_sim.duration": 2.5, "vessel_sim.seed": 7, "controller.hierarchical_printed.sway_weight": 1.5}
    )
    scenario, fell_back = prepare(Task(own, "hierarchical_printed", 50.0))
    assert (fell_back, scenario.controller.rate_hz, scenario.controller.law) == (True, 100.0, "hierarchical_printed")
    changed = scenario.vessel_sim.duration, scenario.vessel_sim.seed, scenario.controller.hierarchical_printed.sway_weight
    assert changed == (2.5, 7, 1.5)


def test_an_unknown_parameter_is_an_error_before_anything_runs() -> None:
    with pytest.raises(ParameterError, match=r"vessel_sim\.duraton is not a parameter"):
        compare([Task(Row("r", changes={"vessel_sim.duraton": 1.0}), "los_pid", None)])


def test_a_simulation_that_diverges_is_an_outcome() -> None:
    wild = Row("wild", changes={"vessel_sim.duration": 50.0, "controller.hierarchical_printed.sway_weight": 30.0}, at_most=1.0)
    outcome = run_task(Task(wild, "hierarchical_printed", None))
    assert "no longer finite" in outcome.failure
    assert comparison.overview_cell(outcome) == "stopped miss"
    head, lines = comparison.table(outcome.row, [outcome])
    assert [len(line) for line in lines] == [len(head)]


def test_a_column_has_the_unit_that_suits_its_largest_value() -> None:
    small = LawRun(Row("boat"), "guided", 50.0, metrics=LawMetrics(0.002, 0.004, 0.001, 1.5, 90.0, 56.0, 0.2, 3.1))
    large = replace(small, law="hierarchical_printed", metrics=LawMetrics(3.0, 4.0, 2.5, 1.5, 2e5, 3.2e6, 0.2, 40.0))
    assert comparison.table(small.row, [small]) == (
        ["law", "Hz", "rms mm", "largest mm", "final mm", "heading °", "force N", "moment N·m", "rev/s", "travel/min"],
        [["guided", "50", "2", "4", "1", "1.5", "90", "56", "0.2", "3.1"]],
    )
    head, lines = comparison.table(small.row, [small, large])
    assert head[6:8] == ["force kN", "moment MN·m"]
    assert lines[1][6:8] == ["200", "3.2"]
    assert [comparison.overview_cell(run) for run in (small, large)] == ["2 mm", "3 m"]


@pytest.mark.long
def test_parallel_runs_give_identical_metrics_in_the_order_of_the_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")  # a few hundred steps take less time than the import of a compiler by each process
    tasks = [Task(Row("long", changes={"vessel_sim.duration": 4.0}), "los_pid", 50.0), Task(ROW, "los_pid", 50.0)]
    reported: list[LawRun] = []
    parallel, serial = compare(tasks, 2, reported.append), compare(tasks, 1)
    assert [o.row.name for o in parallel] == ["long", "circle"]
    assert [o.metrics for o in parallel] == [o.metrics for o in serial]
    assert len(reported) == 2
    np.testing.assert_array_equal(parallel[0].lines, serial[0].lines)


@pytest.mark.long
def test_the_run_folder_has_tables_json_and_a_figure_for_each_case(tmp_path: Path) -> None:
    arguments = [
        "case2_tracking",
        "case2_straight",
        "--laws",
        "hierarchical_printed,los_pid",
        "--set",
        "vessel_sim.duration=1",
        "--workers",
        "1",
    ]
    done = vessel_hsmc(*arguments, "--output", str(tmp_path))
    assert "case2_straight" in done.output
    folder = next(tmp_path.iterdir())
    assert {path.name for path in (folder / "figures").iterdir()} == {"case2_tracking.png", "case2_straight.png"}
    runs = json.loads((folder / "compare.json").read_text())["runs"]
    assert [(r["case"], r["law"]) for r in runs][:2] == [
        ("case2_tracking", "hierarchical_printed"),
        ("case2_tracking", "los_pid"),
    ]
    assert all(r["position_rms"] > 0.0 and r["verdict"] is None for r in runs)
    assert (folder / "compare.html").read_text().count("data-figure=") == 4  # tracks and errors of each case
    assert f"page: {folder / 'compare.html'}" in done.output
    page = (folder / "compare.md").read_text()
    assert page.count("![") == 2
    assert "| case | over | hierarchical_printed | los_pid |" in page  # no column of limits, where no case has one


def test_a_value_on_the_command_line_replaces_that_of_a_row_of_the_suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    suite = tmp_path / "mine.yaml"
    suite.write_text("set: {vessel_sim.duration: 1.0}\nrows:\n  - {name: slow, set: {controller.rate_hz: 20}}\n")
    found: list[Task] = []

    def watched(tasks: list[Task], *_: object) -> list[LawRun]:
        found.extend(tasks)
        return compare(tasks, jobs=1)

    monkeypatch.setattr(comparison, "compare", watched)
    settings = ["vessel_sim.duration=0.5", "controller.rate_hz=50"]
    vessel_hsmc("--suite", str(suite), "--laws", "los_pid", *(f"--set={text}" for text in settings), "--output", str(tmp_path))
    (task,) = found
    assert task.row.changes == {"vessel_sim.duration": 0.5, "controller.rate_hz": 50}


def test_every_row_of_a_suite_has_a_verdict_on_its_own_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    suite = tmp_path / "mine.yaml"
    suite.write_text(
        "set: {vessel_sim.duration: 1.0}\nrows:\n"
        "  - {name: easy, at_most: 100}\n  - {name: hard, at_most: 0.001, largest: 1}\n"
        "  - {name: free}\n  - {name: too, at_most: 50}\n"
    )
    done = vessel_hsmc("--suite", str(suite), "--laws", "los_pid", "--workers", "1", "--output", str(tmp_path / "runs"))
    folder = next((tmp_path / "runs").iterdir())
    runs = json.loads((folder / "compare.json").read_text())["runs"]
    assert [r["verdict"] for r in runs] == ["hit", "miss", None, "hit"]
    assert "0.001 m, largest 1 m" in done.output
    assert (
        "| case | over | limit | rms position error | largest position error | actuator travel [1/min] |"
        in (folder / "compare.md").read_text()
    )
    assert all(r["travel"] >= 0.0 for r in runs)  # 0: saturated during the whole second


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (["case9"], ScenarioError, "scenario case9 is unknown"),
        (["case2_tracking", "--laws", "lqr"], ParameterError, "--laws must be any of hierarchical.*got lqr"),
        (["--suite", "quick"], ScenarioError, "suite quick is unknown"),
    ],
)
def test_a_wrong_argument_is_named(arguments: list[str], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        vessel_hsmc(*arguments)


def test_the_lines_of_all_laws_differ_and_those_of_the_same_law_do_not() -> None:
    looks = [tuple(look.values()) for look in comparison.looks(default_laws()).values()]
    assert len(set(looks)) == len(looks) >= 6
    assert comparison.looks(default_laws())["guided"] == comparison.looks(["my_law"])["guided"]


def test_hits_and_misses_are_coloured() -> None:
    cells = ["guided", "0.00075 m hit", "2 m miss", "stopped miss", "0.1"]
    assert coloured(cells) == ["guided", "[green]0.00075 m hit[/]", "[red]2 m miss[/]", "[red]stopped miss[/]", "0.1"]


def test_numbers_of_the_overview_stay_in_one_piece_in_a_narrow_terminal() -> None:
    out = io.StringIO()
    numbers = ["0.00075 m hit", "0.0097 m miss", "6.6e-05 m hit", "2 m miss"]
    row = coloured(["damping half as much again", "last quarter", "0.02 m", *numbers])
    console = Console(width=80, file=out, color_system=None)
    print_table(["case", "over", "limit", *"abcd"], [row], text_columns=3, console=console)
    shown = out.getvalue()
    assert all(number in shown for number in numbers)
    assert "…" not in shown


def test_recorded_runs_are_compared_in_one_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    folders = []
    for law in ("guided", "los_pid"):
        scenario = load_scenario("case2_tracking", {**SHORT, "controller.law": law})
        folders.append(str(run_offline(scenario, tmp_path / law, lambda _: None, with_page=False).folder.path))
    done = vessel_hsmc(*folders, "--output", str(tmp_path / "compared"))
    assert "guided" in done.output
    assert "los_pid" in done.output
    assert "position error" in done.output
    folder = next((tmp_path / "compared").iterdir())
    assert {path.name for path in folder.iterdir()} == {"figures", "report.html"}
    with pytest.raises(UsageError, match="recorded runs cannot be compared with scenarios"):
        vessel_hsmc(folders[0], "case2_tracking")
    with pytest.raises(BagError, match="is not a bag: it holds 1 run folder"):
        vessel_hsmc(folders[0], str(tmp_path / "guided"))
