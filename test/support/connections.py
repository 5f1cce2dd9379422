"""A healthy connection between boat and controller, as records of messages, into which tests plant mistakes."""

import math
from typing import Any

import numpy as np

from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.preflight.connection import Connection, Endpoint, Finding, Topic
from vessel_hsmc_ros.preflight.expected import connection_of, values_of

STEP, SECONDS = 0.02, 45.0
SHIP = {"vessel.length": 5.0, "vessel.surge_inertia": 550.0, "vessel.yaw_inertia": 700.0}


def voyage(seed: int) -> tuple[Any, Any]:
    """State (n, 6) and wrench (n, 2) of a boat of 550 kg, 50 times a second, under forces and moments that change."""
    rng = np.random.default_rng(seed)
    x = y = psi = u = v = r = 0.0
    states, wrenches = [], []
    force = moment = 0.0
    for k in range(int(SECONDS / STEP)):
        if k % 150 == 0:
            force, moment = rng.uniform(60.0, 250.0), 60.0 + (-1.0) ** (k // 150) * rng.uniform(60.0, 120.0)
        states.append((x, y, psi, u, v, r))
        wrenches.append((force, moment))
        u += STEP * (700.0 * v * r - 70.0 * u + force) / 550.0
        v += STEP * (-550.0 * u * r - 300.0 * v) / 700.0
        r += STEP * (-400.0 * r + moment) / 700.0
        psi += STEP * r
        x += STEP * (u * math.cos(psi) - v * math.sin(psi))
        y += STEP * (u * math.sin(psi) + v * math.cos(psi))
    return np.array(states), np.array(wrenches)


def healthy(seed: int = 1, every: int = 2) -> Connection:
    """A connection by odometry and wrench, with noise, jitter and the controller's parameters by default."""
    rng = np.random.default_rng(seed)
    states, wrenches = (each[::every] for each in voyage(seed))
    n = len(states)
    stamps: Any = 1e3 + STEP * every * np.arange(n)
    received: Any = np.sort(stamps + rng.uniform(0.005, 0.02, n))
    noisy = states + rng.normal(0.0, [0.02, 0.02, 0.005, 0.02, 0.02, 0.005], (n, 6))
    text = {name: np.array([value] * n, dtype=object) for name, value in (("frame", "odom"), ("child", "base_link"))}
    numbers = dict(zip(("x", "y", "psi", "u", "v", "r"), noisy.T, strict=True))
    numbers["psi"] = np.angle(np.exp(1j * numbers["psi"]))
    ones = {"norm": np.ones(n), "up": np.ones(n), "variance": np.zeros(n), "least_variance": np.zeros(n)}
    driver, controller = "driver", "controller"
    topics: dict[str, Any] = {
        "/odom": Topic(
            "/odom",
            (Endpoint(driver, types.ODOMETRY),),
            (Endpoint(controller, types.ODOMETRY, False),),
            received,
            {"stamp": stamps, **text, **numbers, **ones},
        ),
        "/reference": Topic(
            "/reference",
            (Endpoint("reference_ship", types.REFERENCE),),
            (Endpoint(controller, types.REFERENCE, False),),
            received,
            {"stamp": stamps, "frame": text["frame"]},
        ),
        "/cmd_wrench": Topic(
            "/cmd_wrench",
            (Endpoint(controller, types.WRENCH),),
            (Endpoint(driver, types.WRENCH, False),),
            received,
            {"stamp": stamps, "force": wrenches[:, 0], "moment": wrenches[:, 1]},
        ),
    }
    return connection_of(values_of(None, {"controller": SHIP}), {}, topics=topics, events=("stop",), reasons=("OVERDUE",))


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


def of(found: list[Finding], level: str) -> list[str]:
    """What is found on a level."""
    return [f"{about}: {text}" for l, about, text in found if l == level]  # noqa: E741
