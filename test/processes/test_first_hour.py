"""What a newcomer does in the first hour, by the command alone, as the README has it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from durations import rest_long
from harness import exit_code, run_folder

BOAT = ("--length", 4, "--mass", 500, "--surge-force-limit", 300, "--yaw-moment-limit", 250, "--wind", 5)

Execute = Callable[..., str]


@pytest.fixture
def execute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Execute:
    """Execute a command in one folder for all commands, in this process; a command that fails fails the test."""
    monkeypatch.chdir(tmp_path)

    def executed(*arguments: object) -> str:
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *map(str, arguments)])
        code = exit_code()
        shown = capsys.readouterr()
        assert code == 0, shown
        return shown.out + shown.err

    return executed


def summary(output: Path) -> dict[str, Any]:
    folder = run_folder(output)
    assert folder is not None
    content: dict[str, Any] = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    return content


def test_two_commands_lead_from_a_boats_main_data_to_a_page_with_less_than_2_cm_of_error(
    execute: Execute, tmp_path: Path
) -> None:
    execute("init", "my_boat", *BOAT)
    shown = execute("simulate", "./my_boat.yaml", "--set", "reference_ship.circle.speed=1", "--set", "vessel_sim.duration=25")
    assert "warning" not in shown
    metrics = summary(tmp_path / "runs")["metrics"]
    assert metrics["position_error_peak_last_quarter"] < 0.02
    folder = run_folder(tmp_path / "runs")
    assert folder is not None
    assert "position error is" in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("verb", rest_long(["simulate", "run"]))
def test_every_run_of_a_sweep_is_repeated_bit_identically(execute: Execute, tmp_path: Path, verb: str) -> None:
    if verb == "run":
        pytest.importorskip("rclpy")
    axes = ("vessel_sim.initial_pose=[1.0, 2.0, 0.0],[3.0, 4.0, 0.0]", "vessel_sim.seed=1,2")
    execute("sweep", "case2_tracking", *axes, "--set", "vessel_sim.duration=1", "--workers", "1")
    (folder,) = (tmp_path / "runs").iterdir()
    shown = execute(verb, "--campaign", folder, "--run", "3", "--no-page", "--output", tmp_path / "again")
    assert "all metrics are bit-identical to those of row 3 of the campaign" in shown


def test_one_command_sweeps_ten_values_and_draws_them(execute: Execute, tmp_path: Path) -> None:
    values = "controller.guided.position_gain=0.1:1.0:10"
    shown = execute(
        "sweep", "case2_tracking", values, "--set", "controller.law=guided", "--set", "vessel_sim.duration=2", "--workers", "1"
    )
    (folder,) = (tmp_path / "runs").iterdir()
    assert (folder / "figures" / "map.png").stat().st_size > 0
    assert len((folder / "sweep.csv").read_text(encoding="utf-8").splitlines()) == 11
    assert "0.1" in shown
