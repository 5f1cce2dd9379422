"""Bags of a small boat as other recorders write them: exact motion, constant mass, and the faults that such bags have."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from bag_making import STORE, serialized
from mcap.writer import Writer

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.messages.topics import definition
from vessel_hsmc_ros.studies.identification.types import Measurements, simulated, vessel, windows

ODOMETRY, WRENCH = "nav_msgs/msg/Odometry", "geometry_msgs/msg/WrenchStamped"
EPOCH = 1_700_000_000
HULL = {
    "surge_inertia": 500.0,
    "sway_inertia": 700.0,
    "yaw_inertia": 900.0,
    "surge_damping": 80.0,
    "sway_damping": 200.0,
    "yaw_damping": 300.0,
}


def sailed(
    hull: Mapping[str, float] = HULL, duration: float = 60.0, step: float = 0.1, force: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """Rows of time, x, y, psi, u, v, r, X, N of a boat that sails circles to both sides with changing force.

    Args:
        hull: Its data.
        duration: s.
        step: Interval of the rows, s.
        force: Along x and y, N, steady.
    """
    time = np.arange(0.0, duration, step)
    surge = 200.0 * np.where(time // 12 % 2 == 0, 1.0, 0.3)
    moment = 60.0 * np.where(time // 9 % 2 == 0, 1.0, -1.0) * np.where(time // 27 % 3 == 2, 0.3, 1.0)
    wrench = np.column_stack([surge, 0.0 * time, moment])
    whole = windows([Measurements(time, 0.0 * wrench, 0.0 * wrench, wrench)], duration)
    states = simulated(whole, np.zeros((1, 6)), vessel(hull), np.ones(3), np.array([*force, 0.0]))[0]
    return np.column_stack([time, states, surge, moment])


def odometry(stamp: float, row: Array, frame: str = "odom", child: str = "base_link") -> bytes:
    """A serialised Odometry."""
    x, y, psi, u, v, r = map(float, row[1:7])
    T: Any = STORE.types
    vector = T["geometry_msgs/msg/Vector3"]
    quaternion = T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(0.5 * psi), w=math.cos(0.5 * psi))
    pose = T["geometry_msgs/msg/Pose"](position=T["geometry_msgs/msg/Point"](x=x, y=y, z=0.0), orientation=quaternion)
    twist = T["geometry_msgs/msg/Twist"](linear=vector(x=u, y=v, z=0.0), angular=vector(x=0.0, y=0.0, z=r))
    made = T[ODOMETRY](
        header=header(stamp, frame),
        child_frame_id=child,
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)),
    )
    return serialized(made, ODOMETRY)


def wrench(stamp: float, row: Array, frame: str = "base_link") -> bytes:
    """A serialised WrenchStamped."""
    T: Any = STORE.types
    vector = T["geometry_msgs/msg/Vector3"]
    force, torque = vector(x=float(row[7]), y=0.0, z=0.0), vector(x=0.0, y=0.0, z=float(row[8]))
    made = T[WRENCH](header=header(stamp, frame), wrench=T["geometry_msgs/msg/Wrench"](force=force, torque=torque))
    return serialized(made, WRENCH)


def header(stamp: float, frame: str) -> Any:
    """A header with a stamp, s."""
    sec, nanosec = divmod(round(stamp * 1e9), 10**9)
    T: Any = STORE.types
    return T["std_msgs/msg/Header"](stamp=T["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec), frame_id=frame)


def write_boat(
    path: Path,
    rows: Array,
    *,
    topics: tuple[str, str] = ("/odom", "/applied_wrench"),
    stamps: Callable[[float], tuple[float, float]] = lambda time: (EPOCH + time, EPOCH + time),
    extra: Callable[[Writer], object] = lambda _: None,
    reported: Callable[[Array], Array] = lambda row: row,
) -> Path:
    """Write the rows into one MCAP file.

    Args:
        path: The file.
        rows: As `sailed` gives them.
        topics: Names of odometry and wrench.
        stamps: The stamps of both at a time, s; they are recorded at EPOCH + time.
        extra: Writes further channels.
        reported: What the odometry shows of a row.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "boat")
        channels = [
            writer.register_channel(name, "cdr", writer.register_schema(kind, "ros2msg", definition(kind).encode()))
            for name, kind in zip(topics, (ODOMETRY, WRENCH), strict=True)
        ]
        extra(writer)
        for row in rows:
            now, (measured, commanded) = round((EPOCH + row[0]) * 1e9), stamps(float(row[0]))
            writer.add_message(channels[0], now, odometry(measured, reported(row.copy())), now)
            writer.add_message(channels[1], now, wrench(commanded, row), now)
        writer.finish()
    return path
