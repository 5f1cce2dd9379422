"""Mistakes of the sensors of navsat_odom, planted beside a healthy odometry, are named."""

from typing import Any

import numpy as np
import pytest
from connections import SHIP, healthy, of

from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.safety.connection import WRONG, Connection, Endpoint, Topic
from vessel_hsmc_ros.safety.connection_rules import judge
from vessel_hsmc_ros.scenario.connection import connection_of, values_of


def with_sensors(heading: str = "imu", **changes: Any) -> Connection:
    """The healthy connection with navsat_odom and its inputs beside the odometry, some of whose columns are changed."""
    connection = healthy()
    odometry = connection.topics["/odom"]
    n, c = len(odometry.received), odometry.columns
    stamped = {"stamp": c["stamp"]}
    place = {"latitude": 59.9 + c["y"] / 111.4e3, "longitude": 10.7 + c["x"] / 55.9e3, "status": np.zeros(n)}
    sent = {
        "fix": (types.FIX, {**stamped, **place}),
        "imu": (types.IMU, {**stamped, "psi": c["psi"], "norm": c["norm"], "up": c["up"], "r": c["r"], "az": np.full(n, 9.8)}),
        "course": (types.NUMBER, {"value": np.linspace(0.0, 6.0, n)}),
        "speed": (types.NUMBER, {"value": np.full(n, 1.5)}),
    }
    topics = {
        f"/{name}": Topic(
            f"/{name}",
            (Endpoint("driver", kind),),
            (),
            odometry.received,
            {**made, **{k: f(made) for k, f in changes.get(name, {}).items()}},
        )
        for name, (kind, made) in sent.items()
    }
    values = values_of(None, {"controller": SHIP, "navsat_odom": {"velocity": "course", "heading": heading}})
    return connection_of(values, {}, topics={**connection.topics, **topics}, events=("stop",), reasons=("OVERDUE",))


SENSORS: dict[str, tuple[dict[str, Any], str]] = {
    "no fix": ({"fix": {"status": lambda c: c["status"] - 1}}, "no satellite fix"),
    "exchanged": ({"fix": {"latitude": lambda c: c["longitude"] + 90.0}}, "are latitude and longitude, in degrees, exchanged"),
    "no position": ({"fix": {"latitude": lambda c: 0 * c["latitude"], "longitude": lambda c: 0 * c["longitude"]}}, "is at 0, 0"),
    "IMU of FRD": ({"imu": {"az": lambda c: -c["az"]}}, "it is FRD"),
    "IMU in degrees": ({"imu": {"r": lambda c: np.degrees(c["r"])}}, "it takes rad/s, not degrees"),
    "course in degrees": ({"course": {"value": lambda c: np.degrees(c["value"])}}, "it takes rad clockwise from north"),
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


@pytest.mark.parametrize("mistake", SENSORS)
def test_each_mistake_of_a_sensor_is_named(mistake: str) -> None:
    changes, expected = SENSORS[mistake]
    wrong = of(judge(with_sensors(**changes)), WRONG)
    assert any(expected in each for each in wrong), wrong
