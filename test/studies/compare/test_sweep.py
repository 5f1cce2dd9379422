"""`vessel-hsmc sweep`: the plan, the runs, the files."""

import csv
import json
import math
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.simulation.compilation import DISABLED
from vessel_hsmc_ros.studies.campaign import sweep
from vessel_hsmc_ros.studies.campaign.sweep import Axis, Outcome, Point, parse_axis, points, run_all

GAIN, WEIGHT = "controller.guided.position_gain", "controller.hierarchical_printed.sway_weight"
SHORT = {"vessel_sim.duration": 1.0}
METRICS = ("position_error_rms", "yaw_moment_rms")


def vessel_hsmc(*arguments: str) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, ["sweep", *arguments], catch_exceptions=False, standalone_mode=False)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0.1:1.0:4", (0.1, 0.4, 0.7, 1.0)),
        ("0.1:10:3:log", (0.1, 1.0, 10.0)),
        ("0:4:3", (0, 2, 4)),
        ("1:0:3", (1.0, 0.5, 0.0)),
        ("-1:-100:3:log", (-1, -10, -100)),
        ("0.1,0.5,2", (0.1, 0.5, 2)),
        ("guided,los_pid", ("guided", "los_pid")),
        ("[1.0, 2.0],[3.0, 4.0]", ([1.0, 2.0], [3.0, 4.0])),
        ("0.7", (0.7,)),
    ],
)
def test_values_are_a_range_or_a_list(text: str, values: tuple[object, ...]) -> None:
    axis = parse_axis(f"controller.x={text}")
    assert axis == Axis("controller.x", values)
    assert [type(value) for value in axis.values] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (GAIN, "must be node.param=start:stop:count"),
        (f"{GAIN}=0:1", "must be node.param=start:stop:count"),
        (f"{GAIN}=0:1:2:lin", "must be node.param=start:stop:count"),
        (f"{GAIN}=0:1:x", "must be node.param=start:stop:count"),
        (f"{GAIN}=nan:1:3", "must be node.param=start:stop:count"),
        (f"{GAIN}=0:1:1", "count of the sweep must be an integer from 2"),
        (f"{GAIN}=0:1:3:log", "same sign"),
        (f"{GAIN}=[1,", "must be node.param=start:stop:count"),
    ],
)
def test_other_values_are_refused_with_the_form(text: str, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        parse_axis(text)


def test_the_plan_has_every_pair_of_values_for_every_law() -> None:
    planned = points("case2_tracking", [Axis("a.x", (1, 2)), Axis("a.y", (3, 4))], {"a.z": 5}, ["guided", "los_pid"])
    assert [point.values for point in planned] == [(1, 3), (1, 4), (2, 3), (2, 4)] * 2
    assert [point.law for point in planned] == ["guided"] * 4 + ["los_pid"] * 4
    assert planned[5].changes == {"a.z": 5, "controller.law": "los_pid", "a.x": 1, "a.y": 4}


def test_a_swept_parameter_and_a_repeated_law_take_the_place_of_a_further_change() -> None:
    planned = points("case2_tracking", [Axis("a.x", (1, 2))], {"a.x": 7, "a.y": 8, "controller.law": "pd"}, ["guided"])
    assert [dict(point.changes) for point in planned] == [
        {"a.x": 1, "a.y": 8, "controller.law": "guided"},
        {"a.x": 2, "a.y": 8, "controller.law": "guided"},
    ]


@pytest.mark.parametrize("names", [[], ["a.x", "a.x"], ["a.x", "a.y", "a.z"]])
def test_a_sweep_has_one_or_two_different_parameters(names: list[str]) -> None:
    with pytest.raises(ParameterError, match="one or two different parameters"):
        points("case2_tracking", [Axis(name, (1, 2)) for name in names])


def test_a_wrong_value_is_an_error_before_anything_runs() -> None:
    done: list[Outcome] = []
    with pytest.raises(ParameterError, match=rf"{GAIN} must be .*got -2.0"):
        run_all(points("case2_tracking", [Axis(GAIN, (0.1, -2.0))], SHORT), 1, done.append)
    with pytest.raises(ScenarioError, match="case9 is unknown"):
        run_all(points("case9", [Axis(GAIN, (0.1,))]), 1, done.append)
    assert not done


def test_a_run_that_is_unstable_or_fails_is_an_outcome() -> None:
    [unstable] = run_all([Point("case2_tracking", (50.0,), {**SHORT, "controller.rate_hz": 50.0})], 1)
    assert "is unstable at" in unstable.failure
    [diverging] = run_all([Point("case2_tracking", (30.0,), {"vessel_sim.duration": 40.0, WEIGHT: 30.0})], 1)
    assert "no longer finite" in diverging.failure
    assert math.isnan(diverging.value("position_error_rms"))


def test_parallel_and_serial_sweeps_are_identical(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DISABLED, "1")  # a hundred steps take less time than the import of a compiler by each process
    planned = points("case2_tracking", [parse_axis(f"{WEIGHT}=0.001,0.002")], SHORT)
    assert run_all(planned, 2) == run_all(planned, 1)


def test_the_run_folder_has_picture_page_and_all_metrics_of_every_run(tmp_path: Path) -> None:
    done = vessel_hsmc(
        "case2_tracking", f"{WEIGHT}=0.001,0.002", "controller.rate_hz=50.0,100.0", "--set", "vessel_sim.duration=1",
        "--metric", METRICS[0], "--workers", "1", "--output", str(tmp_path),
    )  # fmt: skip
    folder = next(tmp_path.iterdir())
    assert {path.name for path in folder.iterdir()} == {"sweep.csv", "sweep.html", "sweep.json", "sweep.png"}
    with (folder / "sweep.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(row[WEIGHT], row["controller.rate_hz"]) for row in rows] == [
        ("0.001", "50.0"), ("0.001", "100.0"), ("0.002", "50.0"), ("0.002", "100.0"),
    ]  # fmt: skip
    assert [bool(row["failure"]) for row in rows] == [True, False, True, False]
    assert rows[0]["position_error_rms"] == ""
    assert all(float(rows[1][name]) >= 0.0 for name in METRICS)
    document = json.loads((folder / "sweep.json").read_text())
    assert document["parameters"] == {WEIGHT: [0.001, 0.002], "controller.rate_hz": [50.0, 100.0]}
    assert set(document["runs"][1]["metrics"]) == set(Metrics._fields)
    page = (folder / "sweep.html").read_text()
    assert page.count('class="failed"') == 2
    assert page.count("is unstable at") == 2  # the reasons
    assert "data:image/png;base64,iVBOR" in page
    assert "failed" in done.output
    assert "is unstable at" in done.output


def test_a_list_of_texts_can_be_swept_and_drawn(tmp_path: Path) -> None:
    planned = points("case2_tracking", [parse_axis("controller.law=guided,los_pid")], SHORT)
    outcomes = [Outcome(planned[0], metrics=dict.fromkeys(METRICS, 1.0)), Outcome(planned[1], "it failed")]
    files = sweep.write(tmp_path, [Axis("controller.law", ("guided", "los_pid"))], outcomes, METRICS)
    assert all(path.stat().st_size for path in files.values())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["case2_tracking", f"{GAIN}=0.1,0.2", "--metric", "speed"], "--metric must be any of.*got speed"),
        (["case2_tracking", f"{GAIN}=0.1,0.2", "--laws", "lqr"], "--laws must be .*got lqr"),
        (["case2_tracking", "controller.guided.position_gian=0.1,0.2"], "did you mean guided.position_gain"),
    ],
)
def test_a_wrong_argument_is_named(arguments: list[str], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        vessel_hsmc(*arguments)
