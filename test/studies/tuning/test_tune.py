"""`vessel-hsmc tune`: the command and its files."""

import csv
import json
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner, Result
from unrendered import leave_unrendered

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.options import parse_changes
from vessel_hsmc_ros.core.exceptions import ScenarioError
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.tuning.result import advice

GAINS = ("controller.los_pid.surge_gain", "controller.los_pid.yaw_damping")
SUITE = """
set:
  controller.law: los_pid
  controller.rate_hz: 10.0
  reference_ship.rate_hz: 10.0
  vessel_sim.rate_hz: 10.0
  vessel_sim.duration: 5.0
rows:
  - {name: calm}
  - {name: noise, set: {vessel_sim.sensors.position_noise: 0.1}, at_most: 20.0}
"""


def vessel_hsmc(*arguments: str) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, [*arguments], catch_exceptions=False, standalone_mode=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a tuning, with the output of the command in output.txt."""
    folder = tmp_path_factory.mktemp("tune")
    (folder / "suite.yaml").write_text(SUITE)
    arguments = [part for gain in GAINS for part in ("--gain", gain)]
    done = vessel_hsmc(
        "tune", str(folder / "suite.yaml"), *arguments, "--trials", "6", "--workers", "1",
        "--second-metric", "yaw_moment_rms", "--output", str(folder),
    )  # fmt: skip
    (folder / "output.txt").write_text(done.output)
    return folder


def test_the_tuned_gains_are_a_parameters_file_for_any_scenario(folder: Path) -> None:
    nested = yaml.safe_load((folder / "best.yaml").read_text())["/**/controller"]["ros__parameters"]
    assert set(nested) == {"law", "los_pid"}
    scenario = load_scenario("case2_slalom", parse_changes([f"@{folder / 'best.yaml'}", "controller.rate_hz=50"]))
    assert (scenario.controller.law, scenario.controller.rate_hz) == ("los_pid", 50.0)
    assert scenario.controller.los_pid.surge_gain == nested["los_pid"]["surge_gain"]
    assert load_scenario(folder / "best.yaml").controller.los_pid == scenario.controller.los_pid


def test_the_trials_are_a_table_with_the_front(folder: Path) -> None:
    with (folder / "trials.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["trial"]) for row in rows] == list(range(6))
    assert all(float(row[name]) > 0.0 for row in rows for name in (*GAINS, "cost", "effort"))
    front = [(float(row["cost"]), float(row["effort"])) for row in rows if row["front"] == "1"]
    assert front
    every = [(float(row["cost"]), float(row["effort"])) for row in rows]
    assert not any(cost < c and effort < e for c, e in front for cost, effort in every)


def test_the_summary_compares_present_and_tuned_gains_on_seen_and_unseen_runs(folder: Path) -> None:
    summary = json.loads((folder / "tune.json").read_text())
    assert summary["definition"]["objectives"] == ["position_error_rms_last_quarter", "yaw_moment_rms"]
    assert set(summary["gains"]["tuned"]) == set(GAINS)
    for part in ("cases", "held_out"):
        assert [run["case"] for run in summary[part]["runs"]] == ["calm", "noise"]
        assert summary[part]["tuned"]["failed"] == 0
    assert summary["cases"]["runs"] != summary["held_out"]["runs"]


def test_where_no_trial_is_better_the_present_gains_are_to_be_kept() -> None:
    (line,) = advice(1.0, 2.4)
    assert line.startswith("No trial is better: keep the present gains.")
    assert advice(1.0, 1.01) == advice(1.0, 0.5) == []


def test_the_page_contains_the_verdict_and_the_diagrams_of_both_pictures(folder: Path) -> None:
    page = (folder / "tune.html").read_text()
    assert page.count("data-figure=") == 2 + len(GAINS)
    assert all((folder / name).stat().st_size > 0 for name in ("front.png", "search.png"))
    assert "On the held-out runs the cost" in page
    assert "On the held-out runs the cost" in (folder / "output.txt").read_text()


def test_a_run_without_noise_has_no_other_seeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    short = [part for node in ("vessel_sim", "controller", "reference_ship") for part in ("--set", f"{node}.rate_hz=10")]
    done = vessel_hsmc(
        "tune", "case2_tracking", "--law", "guided", "--gain", "controller.guided.position_gain", *short, "--workers", "1",
        "--set", "vessel_sim.duration=1", "--trials", "1", "--output", str(tmp_path / "new" / "folder"),
    )  # fmt: skip
    assert "they contain no noise" in done.output


def test_a_file_of_changes_that_is_none_is_named(tmp_path: Path) -> None:
    (tmp_path / "best.yaml").write_text("a: 1")
    with pytest.raises(ScenarioError, match=r"parameters file .*best.yaml: section a has no ros__parameters"):
        parse_changes([f"@{tmp_path / 'best.yaml'}"])
    with pytest.raises(ScenarioError, match=r"nowhere.yaml cannot be read"):
        parse_changes(["@nowhere.yaml"])
