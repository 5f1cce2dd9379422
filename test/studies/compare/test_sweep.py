"""`vessel-hsmc sweep`, a campaign on a grid: the plan, the runs, the files."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import CampaignError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies.campaign import findings
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, Row, read_sweep_rows
from vessel_hsmc_ros.studies.campaign.distributions import Grid, parse_axis, parse_distribution
from vessel_hsmc_ros.studies.campaign.execute import compute_rows
from vessel_hsmc_ros.studies.campaign.plan import Campaign, sweep_of
from vessel_hsmc_ros.studies.campaign.report import diagrams, write_sweep
from vessel_hsmc_ros.studies.campaign.results import Results, of_rows

GAIN, WEIGHT = "controller.guided.position_gain", "controller.hierarchical_printed.sway_weight"
RATE, SEED, MODE = "controller.rate_hz", "vessel_sim.seed", "reference_ship.mode"
SHORT = {"vessel_sim.duration": 1.0}
METRICS = ("position_error_rms", "yaw_moment_rms")


def vessel_hsmc(*arguments: str) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, ["sweep", *arguments], catch_exceptions=False, standalone_mode=False)


def invented(plan: Campaign) -> list[dict[str, Any]]:
    """Rows with metrics that differ from run to run; the last one has ended early."""
    rows = []
    for run in range(plan.runs):
        planned, failure = plan.planned(run), "it failed" if run == plan.runs - 1 else ""
        metrics = {} if failure else dict.fromkeys(Metrics._fields, 1.0 + run)
        row = {"run": run, "draw": planned.draw, "law": planned.law, "seed": planned.seed, **planned.values}
        rows.append({**row, "failed": bool(failure), "failure": failure, "ended_early": bool(failure), **metrics})
    return rows


def swept(*axes: str, laws: tuple[str, ...] = ("guided",)) -> Results:
    plan = sweep_of("case2_tracking", axes, SHORT, laws, METRICS)
    return of_rows(plan, invented(plan))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0.1:1.0:4", (0.1, 0.4, 0.7, 1.0)),
        ("0.1:10:3:log", (0.1, 1.0, 10.0)),
        ("1:0:3", (1.0, 0.5, 0.0)),
        ("-1:-100:3:log", (-1.0, -10.0, -100.0)),
        ("0.1,0.5,2", (0.1, 0.5, 2)),
        ("circle,straight", ("circle", "straight")),
        ("[1.0, 2.0],[3.0, 4.0]", ([1.0, 2.0], [3.0, 4.0])),
        ("0.7", (0.7,)),
    ],
)
def test_values_are_a_range_or_a_list(text: str, values: tuple[object, ...]) -> None:
    name, entry = parse_axis(f"controller.x={text}")
    assert name == "controller.x"
    grid, relative = parse_distribution(entry)
    assert isinstance(grid, Grid)
    assert (grid.values, relative) == (values, False)
    assert [type(value) for value in grid.values] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (GAIN, "values must be .* at least one value"),
        (f"{GAIN}=0:1", "must be node.param=start:stop:count"),
        (f"{GAIN}=0:1:2:lin", "must be node.param=start:stop:count"),
        (f"{GAIN}=0:1:x", "must be node.param=start:stop:count"),
        (f"{GAIN}=nan:1:3", "grid must be .* finite numbers"),
        (f"{GAIN}=0:1:1", "an integer count from 2"),
        (f"{GAIN}=0:1:3:log", "same sign"),
        (f"{GAIN}=[1,", "must be node.param=start:stop:count"),
        (f"{GAIN}=0.1,-2.0", f"{GAIN} must be .*got -2.0"),
        ("controller.law=guided,pd", "give several laws as `laws`"),
    ],
)
def test_other_values_are_refused_with_the_form(text: str, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        sweep_of("case2_tracking", [text], SHORT)


def test_the_plan_has_every_pair_of_values_for_every_law_with_the_noise_of_the_scenario() -> None:
    changes = {**SHORT, SEED: 5}
    plan = sweep_of("case2_tracking", [f"{GAIN}=1,2", f"{RATE}=50,100"], changes, ["guided", "los_pid"])
    runs = [plan.planned(run) for run in range(plan.runs)]
    pairs = [(1.0, 50.0), (1.0, 100.0), (2.0, 50.0), (2.0, 100.0)]
    assert [(*run.values.values(), run.law) for run in runs] == [(*pair, law) for pair in pairs for law in ("guided", "los_pid")]
    assert {run.seed for run in runs} == {5}
    scenario = plan.scenario(5)
    assert (scenario.controller.law, scenario.controller.guided.position_gain, scenario.controller.rate_hz) == (
        "los_pid",
        2.0,
        50.0,
    )
    assert scenario.vessel_sim.duration == 1.0


def test_a_swept_parameter_and_a_repeated_law_take_the_place_of_a_further_change() -> None:
    plan = sweep_of("case2_tracking", [f"{SEED}=3,4"], {**SHORT, SEED: 7, "controller.law": "pd"}, ["guided"])
    assert [(plan.planned(run).seed, plan.planned(run).law) for run in range(plan.runs)] == [(3, "guided"), (4, "guided")]


@pytest.mark.parametrize("axes", [[], [f"{GAIN}=1"] * 2, [f"{GAIN}=1", f"{RATE}=50", f"{SEED}=1"]])
def test_a_sweep_has_one_or_two_different_parameters(axes: list[str]) -> None:
    with pytest.raises(ParameterError, match="one or two different parameters"):
        sweep_of("case2_tracking", axes)


def test_an_unknown_scenario_is_an_error_before_anything_runs() -> None:
    with pytest.raises(ScenarioError, match="case9 is unknown"):
        sweep_of("case9", [f"{GAIN}=0.1"])


def test_a_run_that_is_unstable_or_fails_is_a_row() -> None:
    unstable = sweep_of("case2_tracking", [f"{RATE}=50"], SHORT)
    (row,) = compute_rows(unstable, range(1))
    assert "is unstable at" in row["failure"]
    (row,) = rows = compute_rows(sweep_of("case2_tracking", [f"{WEIGHT}=30"], {"vessel_sim.duration": 40.0}), range(1))
    assert "no longer finite" in row["failure"]
    assert math.isnan(of_rows(unstable, rows).rows["position_error_rms"][0])


@pytest.mark.long
def test_parallel_and_serial_sweeps_are_identical(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")  # a hundred steps take less time than the import of a compiler by each process
    plan = sweep_of("case2_tracking", [f"{WEIGHT}=0.001,0.002"], SHORT)
    assert compute_rows(plan, range(2), 2) == compute_rows(plan, range(2), 1)


def test_the_run_folder_has_page_pictures_plan_and_all_metrics_of_every_run(tmp_path: Path) -> None:
    done = vessel_hsmc(
        "case2_tracking", f"{WEIGHT}=0.001,0.002", f"{RATE}=50.0,100.0", "--set", "vessel_sim.duration=1",
        "--metric", METRICS[0], "--workers", "1", "--output", str(tmp_path),
    )  # fmt: skip
    folder = next(tmp_path.iterdir())
    assert {"sweep.csv", "sweep.html", "campaign.yaml", "scenario.yaml", "figures"} < {path.name for path in folder.iterdir()}
    with (folder / "sweep.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(row[WEIGHT], row[RATE]) for row in rows] == [
        ("0.001", "50.0"), ("0.001", "100.0"), ("0.002", "50.0"), ("0.002", "100.0"),
    ]  # fmt: skip
    assert [bool(row["failure"]) for row in rows] == [True, False, True, False]
    assert rows[0]["position_error_rms"] == ""
    assert all(float(rows[1][name]) >= 0.0 for name in METRICS)
    page = (folder / "sweep.html").read_text()
    content = json.loads(page.split('id="content">')[1].split("</script>")[0])
    assert [each["title"] for each in content["figures"]["map"]] == [
        "hierarchical_printed: position error, rms with the approach [m]"
    ]
    assert page.count("none: ended early") >= 2
    assert "run 0: " in done.output
    assert "is unstable at" in done.output
    assert Campaign.of_folder(folder).scenario(3).controller.rate_hz == 100.0  # `run --campaign` repeats a run


def test_the_table_and_the_file_of_a_sweep_have_every_value_in_its_own_place(tmp_path: Path) -> None:
    results = swept(f"{GAIN}=0.5,1.5", f"{RATE}=20,50,100")
    table = findings.points(results)
    assert table.head == ("run", "law", GAIN, RATE, "position error, rms with the approach", "yaw moment, rms")
    shown = [[cell.value for cell in line] for line in table.lines]
    assert shown[1] == ["1", "guided", "0.5", "50", "2 m", "2 N·m"]
    assert shown[5] == ["5", "guided", "1.5", "100", "none: ended early", "none: ended early"]
    write_sweep(results, invented(results.campaign), tmp_path)
    with (tmp_path / "sweep.csv").open() as stream:
        read = list(csv.DictReader(stream))
    assert [(row["law"], row[GAIN], row[RATE], row["failure"]) for row in read][4:] == [
        ("guided", "1.5", "50.0", ""),
        ("guided", "1.5", "100.0", "it failed"),
    ]
    assert [row["yaw_moment_at_limit"] for row in read] == ["1.0", "2.0", "3.0", "4.0", "5.0", ""]


def test_a_map_has_the_first_parameter_across_the_second_upwards_and_a_cross_where_a_run_ended_early() -> None:
    first, second = diagrams(swept(f"{GAIN}=0.5,1.5", f"{RATE}=20,50"), {})["map"]
    assert (first["title"], second["title"]) == (
        "guided: position error, rms with the approach [m]",
        "guided: yaw moment, rms [N·m]",
    )
    assert first["layout"]["xaxis"]["title"]["text"] == "guided.position_gain"
    cells, cross = first["traces"]
    assert (cells["type"], cells["z"]) == ("heatmap", [[1.0, 3.0], [2.0, None]])
    assert (cells["x"], cells["y"]) == ([0.0, 1.0, 2.0], [5.0, 35.0, 65.0])
    assert cells["customdata"][0][1] == [2, "1.5", "20", "3"]  # a click shows the command of the run
    assert (cross["x"], cross["y"], cross["marker"]["symbol"]) == ([1.5], [50.0], "x")


def test_cells_on_a_logarithmic_scale_meet_midway_on_it_and_a_single_value_has_a_cell() -> None:
    first, _ = diagrams(swept(f"{GAIN}=0.01,1,100", f"{RATE}=20"), {})["map"]
    cells = first["traces"][0]
    np.testing.assert_allclose(cells["x"], [0.001, 0.1, 10.0, 1000.0])
    assert cells["y"] == [19.5, 20.5]


def test_the_lines_of_a_sweep_have_their_own_values_scales_and_failures() -> None:
    error, _ = diagrams(swept(f"{GAIN}=0.1,1.0,10.0", laws=("guided", "los_pid")), {})["map"]
    guided, los_pid, crosses = error["traces"]
    assert (guided["name"], guided["x"], guided["y"]) == ("guided", [0.1, 1.0, 10.0], [1.0, 3.0, 5.0])
    assert (los_pid["name"], los_pid["y"]) == ("los_pid", [2.0, 4.0, None])
    assert guided["line"]["color"] != los_pid["line"]["color"]
    assert (crosses["x"], crosses["y"], crosses["marker"]["symbol"]) == ([10.0], [5.5], "x")
    assert error["layout"]["xaxis"]["type"] == "log"


@pytest.mark.long
def test_texts_and_lists_can_be_swept_and_drawn(tmp_path: Path) -> None:
    results = swept(f"{MODE}=circle,straight", "vessel_sim.initial_pose=[1.0, 2.0, 0.0],[3.0, 4.0, 0.0]")
    first, _ = diagrams(results, {})["map"]
    assert first["layout"]["xaxis"]["ticktext"] == ["circle", "straight"]
    assert first["layout"]["yaxis"]["ticktext"] == ["(1.0, 2.0, 0.0)", "(3.0, 4.0, 0.0)"]
    rows = invented(results.campaign)
    files = write_sweep(results, rows, tmp_path)
    assert all(path.stat().st_size for path in files.values())
    missing = dict.fromkeys(Metrics._fields)
    plan = Campaign.of_folder(tmp_path)
    assert read_sweep_rows(Dataset(tmp_path), plan) == [missing | row for row in rows]
    assert dict(Row.read(tmp_path, 2).values) == rows[2]


@pytest.mark.long
def test_a_damaged_table_of_a_sweep_is_named(tmp_path: Path) -> None:
    results = swept(f"{GAIN}=0.5,1.5")
    write_sweep(results, invented(results.campaign), tmp_path)
    path = tmp_path / "sweep.csv"
    path.write_text(path.read_text().replace("1.5,", "one,"))
    with pytest.raises(CampaignError, match=r"sweep\.csv is damaged"):
        Row.read(tmp_path, 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["case2_tracking", f"{GAIN}=0.1,0.2", "--metric", "speed"], "metrics must be any of.*got speed"),
        (["case2_tracking", f"{GAIN}=0.1,0.2", "--laws", "lqr"], "--laws must be .*got lqr"),
        (["case2_tracking", "controller.guided.position_gian=0.1,0.2"], "did you mean controller.guided.position_gain"),
    ],
)
def test_a_wrong_argument_is_named(arguments: list[str], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        vessel_hsmc(*arguments)
