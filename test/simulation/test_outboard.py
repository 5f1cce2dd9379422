"""A boat with an outboard: the plant gives no more moment than thrust and speed allow, and a law that is told of it steers."""

from dataclasses import replace

import numpy as np
import pytest

from vessel_hsmc_ros.core.hull import moment_limit, steering
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop
from vessel_hsmc_ros.studies.comparison import Task, prepare
from vessel_hsmc_ros.studies.suite import load_suite

ROW = next(row for row in load_suite("boats") if row.name == "figure eight, 5 m")


def sailed(**changes: object) -> tuple[Scenario, ClosedLoop, Array]:
    """A figure of eight, its run, and the distances from the reference after the first third, m."""
    dotted = {name.replace("__", "."): value for name, value in changes.items()}
    scenario, _ = prepare(Task(replace(ROW, changes={**ROW.changes, "vessel_sim.duration": 240.0, **dotted}), "guided", None))
    run = ClosedLoop(scenario)
    run.run()
    published = run.published()
    rows = np.searchsorted(published.reference_stamp, published.stamp, side="right") - 1
    away = np.hypot(*(published.odometry[:, :2] - published.reference[rows, :2]).T)
    return scenario, run, away[len(away) // 3 :]


def test_a_law_that_is_told_of_an_outboard_keeps_its_track_and_one_that_is_not_does_not() -> None:
    told, untold = (sailed(**{f"{whose}__steering_loss": 1.0})[2] for whose in ("vessel", "vessel_sim__vessel"))
    assert np.sqrt((told**2).mean()) < 0.25 * np.sqrt((untold**2).mean())
    assert told.max() < 10.0


@pytest.mark.parametrize("loss", [0.4, 1.0])
def test_the_plant_never_gives_more_than_the_thrust_allows(loss: float) -> None:
    scenario, run, _ = sailed(vessel_sim__vessel__steering_loss=loss, vessel_sim__duration=60.0)
    applied, p = run.result().wrench, scenario.vessel_sim.vessel
    made = steering(loss, np.inf, p.surge_force_limit, p.yaw_moment_limit)
    limits = np.array([moment_limit(force, 0.0, made) for force in applied[:, 0].tolist()])
    assert (np.abs(applied[:, 1]) <= limits * (1.0 + 1e-12)).all()
    assert (np.abs(applied[:, 1]) > 0.99 * limits).any(), "and it was tried"
