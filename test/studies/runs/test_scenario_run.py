"""`vessel-hsmc simulate`: the run folder of an offline run, complete, failed, interrupted or without a bag."""

import json
import signal
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from unrendered import leave_unrendered

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.plant.simulator import Simulator

SHORT = ["case2_tracking", "--set", "vessel_sim.duration=1"]
UNSTABLE = ["case2_tracking", "--set", "controller.hierarchical_printed.sway_weight=30.0", "--set", "vessel_sim.duration=60"]


def vessel_hsmc(*arguments: str) -> Result:
    """Call the command in this process; its errors are raised."""
    return CliRunner().invoke(cli, arguments, catch_exceptions=False, standalone_mode=False)


def simulated(output: Path, *arguments: str) -> tuple[Result, Path]:
    done = vessel_hsmc("simulate", *arguments, "--output", str(output))
    return done, next(output.iterdir())


@pytest.mark.long
def test_the_run_folder_of_simulate_is_taken_by_replay_and_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    done, folder = simulated(tmp_path, *SHORT)
    assert done.exit_code == 0
    assert {path.name for path in folder.iterdir()} == {"bag", "figures", "params.yaml", "report.html", "run.json"}
    assert "101 commands over 1 s" in vessel_hsmc("replay", str(folder), "--verify").output
    (folder / "report.html").unlink()
    assert "page:" in vessel_hsmc("report", str(folder)).output
    assert (folder / "report.html").is_file()


def test_a_run_that_diverges_is_recorded_up_to_there(tmp_path: Path) -> None:
    done, folder = simulated(tmp_path, *UNSTABLE)
    assert done.exit_code == 1
    summary = json.loads((folder / "run.json").read_text())
    assert summary["exit_code"] == 1
    assert "no longer finite" in summary["failure"]
    bag = open_bag(folder)
    assert bag["odom"].count == summary["steps"] > 2000
    assert not (folder / "report.html").exists()


def test_an_interrupted_run_is_recorded_up_to_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original = Simulator.disturbance

    def disturbance(self: Simulator, time: float) -> tuple[float, float, float]:
        if time > 0.5:
            signal.raise_signal(signal.SIGINT)
        return original(self, time)

    monkeypatch.setattr(Simulator, "disturbance", disturbance)
    done, folder = simulated(tmp_path, *SHORT, "--interpreted")
    assert done.exit_code == 130
    assert json.loads((folder / "run.json").read_text())["failure"] == "interrupted by SIGINT"
    assert open_bag(folder)["odom"].count == 51


def test_without_a_page_there_are_bag_and_metrics_and_a_report_is_made_later(tmp_path: Path) -> None:
    _, folder = simulated(tmp_path, *SHORT, "--no-page")
    assert {path.name for path in folder.iterdir()} == {"bag", "params.yaml", "run.json"}
    assert json.loads((folder / "run.json").read_text())["metrics"]["position_error_rms"] > 0.0


def test_without_a_bag_page_and_metrics_are_still_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)
    done, folder = simulated(tmp_path, *SHORT, "--no-bag")
    assert done.exit_code == 0
    assert (folder / "report.html").is_file()
    assert not (folder / "bag").exists()
    assert json.loads((folder / "run.json").read_text())["metrics"]["position_error_rms"] > 0.0
