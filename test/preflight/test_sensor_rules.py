"""Mistakes of the sensors of navsat_odom, planted beside a healthy odometry, are named."""

from typing import Any

import numpy as np
import pytest
from connections import of, with_sensors
from durations import rest_long

from vessel_hsmc_ros.preflight.connection import WRONG
from vessel_hsmc_ros.preflight.rules import judge

SENSORS: dict[str, tuple[dict[str, Any], str]] = {
    "no fix": ({"fix": {"status": lambda c: c["status"] - 1}}, "no satellite fix"),
    "exchanged": ({"fix": {"latitude": lambda c: c["longitude"] + 90.0}}, "are latitude and longitude, in degrees, exchanged"),
    "no position": ({"fix": {"latitude": lambda c: 0 * c["latitude"], "longitude": lambda c: 0 * c["longitude"]}}, "is at 0, 0"),
    "IMU of FRD": ({"imu": {"az": lambda c: -c["az"]}}, "it is FRD"),
    "IMU in degrees": ({"imu": {"r": lambda c: np.degrees(c["r"])}}, "it must be in rad/s, not degrees"),
    "course in degrees": ({"course": {"value": lambda c: np.degrees(c["value"])}}, "it must be in rad clockwise from north"),
    "mirror image": (
        {
            "fix": {
                "latitude": lambda c: 59.9 + (c["longitude"] - 10.7) / 2,
                "longitude": lambda c: 10.7 + (c["latitude"] - 59.9) * 2,
            }
        },
        "the odometry is a mirror image of the fixes",
    ),
}


def test_sensors_without_a_mistake_have_none() -> None:
    assert of(judge(with_sensors()), WRONG) == []


def test_a_driver_of_angles_without_a_status_is_one_where_it_is_declared() -> None:
    angles: Any = {
        "imu": {"norm": lambda c: 70.0 * c["norm"], "r": lambda c: 57.3 * c["r"]},
        "fix": {"status": lambda c: c["status"] - 2},
    }
    assert of(judge(with_sensors("imu_euler", **angles)), WRONG) == []
    assert any("is an angle in place of a quaternion" in each for each in of(judge(with_sensors(**angles)), WRONG))


@pytest.mark.parametrize("mistake", rest_long(SENSORS, 5))
def test_each_mistake_of_a_sensor_is_named(mistake: str) -> None:
    changes, expected = SENSORS[mistake]
    wrong = of(judge(with_sensors(**changes)), WRONG)
    assert any(expected in each for each in wrong), wrong
