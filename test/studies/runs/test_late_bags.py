"""Bags of runs with late odometry: read and verified by the steps that their messages belong to."""

from pathlib import Path

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.run_from_bag import shown_at
from vessel_hsmc_ros.bags.run_to_bag import write_bag
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop
from vessel_hsmc_ros.studies.identification.measurements import from_bag
from vessel_hsmc_ros.studies.verification import verify

DURATION = 4.0
RATES = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}


def written(folder: Path, duration: float) -> tuple[Bag, ClosedLoop]:
    late = {"vessel_sim.sensors.delay": 0.25, "vessel_sim.actuators.yaw_dead_time": 0.2, "vessel_sim.duration": duration}
    changes = {"controller.law": "los_pid", "controller.observer.enabled": True, **late, **RATES}
    scenario = load_scenario("case2_tracking", changes)
    loop = ClosedLoop(scenario, interpreted=True)
    loop.run()
    write_bag(folder / "bag", loop.published(), scenario)
    return open_bag(folder / "bag"), loop


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("late")


@pytest.fixture(scope="module")
def late(folder: Path) -> tuple[Bag, ClosedLoop]:
    return written(folder, DURATION)


@pytest.mark.parametrize("duration", rest_long([DURATION, 0.1]))
def test_the_run_of_a_late_bag_is_bit_identical_to_the_run(tmp_path: Path, late: tuple[Bag, ClosedLoop], duration: float) -> None:
    bag, loop = late if duration == DURATION else written(tmp_path, duration)
    read, run = bag.run(), loop.result()
    for field in ("time", "state", "measured", "reference", "wrench", "disturbance", "unforced_acceleration"):
        np.testing.assert_array_equal(getattr(read, field), getattr(run, field), err_msg=field)
    for field, values in run.control.items():
        np.testing.assert_array_equal(read.control[field], values, err_msg=field)


def test_the_stamps_of_late_odometry_are_those_of_its_measurements(late: tuple[Bag, ClosedLoop]) -> None:
    bag, _ = late
    truth, odometry = bag["/odom/truth"], bag["/odom"]
    assert odometry.stamp[5:].tolist() == truth.stamp[:-5].tolist()
    np.testing.assert_array_equal(odometry["pose.pose.position.x"][5:], truth["pose.pose.position.x"][:-5])


def test_what_is_identified_from_a_late_bag_is_each_measurement_once_with_its_own_time(
    folder: Path, late: tuple[Bag, ClosedLoop]
) -> None:
    run, found = late[1].result(), from_bag(folder / "bag")
    delay = 5
    np.testing.assert_allclose(found.time, run.time[: len(found.time)], atol=1e-9)
    assert len(found.time) == len(run.time) - delay
    np.testing.assert_array_equal(found.pose[:, :2], run.measured[delay:, :2])


def test_a_late_bag_is_verified_to_the_bit(late: tuple[Bag, ClosedLoop]) -> None:
    bag, _ = late
    found = verify(bag, bag.scenario())
    assert len(found.time) == 81
    assert not len(found.differing)


def test_the_steps_of_late_odometry_follow_from_its_repetitions() -> None:
    steps = 10 * np.arange(12)
    prompt = steps[2:9]
    np.testing.assert_array_equal(shown_at(prompt, steps), prompt)
    late = np.array([0, 0, 0, 10, 20, 30, 40])
    np.testing.assert_array_equal(shown_at(late, steps), 10 * np.arange(7))
    # After a reset of the plant it begins anew.
    reset = np.array([0, 0, 0, 10, 20, 50, 50, 50, 60, 70])
    np.testing.assert_array_equal(shown_at(reset, steps), 10 * np.arange(10))
    # The last odometry of a cut bag has no step that is known.
    cut = shown_at(late, steps[:6])
    np.testing.assert_array_equal(cut[:6], steps[:6])
    assert cut[6] not in steps
