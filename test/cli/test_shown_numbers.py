"""What the command shows: errors along the hull, turns to either side, and predictions before and after an identification."""

import math
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from otter_runs import OTTER, otter
from records import make_run

from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.cli.watch import line, quantities
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.nodes.observation import NodeStatus, Snapshot
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.studies.campaign import execute
from vessel_hsmc_ros.studies.identification.excitation import Step, table
from vessel_hsmc_ros.studies.identification.study import judged


@pytest.mark.parametrize(
    ("psi", "shown"),
    [
        (0.0, "0.3 m ahead, 0.4 m to port"),
        (0.5 * math.pi, "0.4 m ahead, -0.3 m to port"),
        (math.pi, "-0.3 m ahead, -0.4 m to port"),
    ],
)
def test_the_position_error_is_shown_along_and_across_the_hull(psi: float, shown: str) -> None:
    ship, desired = Motion(10.3, 5.4, psi, 1.0, 0.0, 0.0), Motion(10.0, 5.0, psi, 1.0, 0.0, 0.0)
    snapshot = Snapshot(1.5, ship, desired, (5e4, -3e6), (2e5, math.inf), {}, {}, [])
    assert quantities(snapshot)["error"] == f"0.5 m ({shown}), heading 0.00 deg"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_largest_yaw_rate_of_a_manoeuvre_is_that_to_either_side(side: float) -> None:
    time = np.arange(0.0, 20.0, 0.1)
    turning = np.where(time < 10.0, 0.2, -0.1) * side
    state = np.column_stack([*np.zeros((3, len(time))), np.ones(len(time)), np.zeros(len(time)), turning])
    rows = table([Step("first", 1.0, side, 10.0), Step("second", 0.5, -side, 10.0)], make_run(time, state))
    assert [row[-1] for row in rows] == ["11.5°/s", "5.7°/s"]


def test_a_held_out_run_is_predicted_by_the_start_vessel_before_and_by_the_identified_one_after() -> None:
    run = otter(0, 10.0, rich=True, held=True, duration=30.0)
    start = read_vessel("otter")
    heavier = {name: 1.5 * value for name, value in OTTER.items()}
    (found,) = judged([run], SimpleNamespace(values=heavier, inputs={}), start, 10.0)  # type: ignore[arg-type]
    before, after = found.before, found.prediction
    assert before is not None
    assert before.rms()["position"] < 0.5 * after.rms()["position"]


def test_a_sweep_changes_what_is_set_in_every_run(monkeypatch: pytest.MonkeyPatch) -> None:
    planned: list[Any] = []

    def compute(campaign: Any, runs: Any, *_: Any) -> Any:
        planned.extend(map(campaign.scenario, runs))
        raise click.Abort

    monkeypatch.setattr(execute, "compute_rows", compute)
    gain, duration = "controller.guided.position_gain", "vessel_sim.duration"
    arguments = ["sweep", "case2_tracking", f"{gain}=0.5,0.6", "--set", f"{duration}=0.5", "--laws", "guided"]
    with pytest.raises(click.Abort):
        CliRunner().invoke(cli, arguments, standalone_mode=False, catch_exceptions=False)
    assert [(each.controller.guided.position_gain, each.vessel_sim.duration) for each in planned] == [(0.5, 0.5), (0.6, 0.5)]


def test_a_line_names_the_nodes_with_warnings_and_errors() -> None:
    nodes = {name: NodeStatus(name, f"has {name}", {}) for name in ("ok", "warning", "error")}
    snapshot = Snapshot(1.5, None, None, None, (2e5, 3e6), {}, nodes, [])
    assert line(snapshot) == "time 1.5 s; error: has error; warning: has warning"
