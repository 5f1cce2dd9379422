"""Mistakes of wiring: what plants each into a connection, and the text by which the rules name it."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.preflight.connection import Connection, Endpoint, Topic


def changed(connection: Connection, topic: str, **changes: Any) -> Connection:
    return connection._replace(topics={**connection.topics, topic: connection.topics[topic]._replace(**changes)})


def columns(topic: str = "/odom", **new: Callable[[Any], Any]) -> Callable[[Connection], Connection]:
    """A change of columns: each new one by a function of all columns."""

    def plant(connection: Connection) -> Connection:
        old = connection.topics[topic].columns
        return changed(connection, topic, columns={**old, **{name: rule(old) for name, rule in new.items()}})

    return plant


def ends(topic: str, **new: Any) -> Callable[[Connection], Connection]:
    return lambda connection: changed(connection, topic, **new)


def times(rule: Callable[[Any], Any]) -> Callable[[Connection], Connection]:
    """A change of the times of receipt and of the stamps, as by a driver that is late."""

    def plant(connection: Connection) -> Connection:
        topic = connection.topics["/odom"]
        return changed(
            connection, "/odom", received=rule(topic.received), columns={**topic.columns, "stamp": rule(topic.received)}
        )

    return plant


def every(k: int) -> Callable[[Connection], Connection]:
    """Only every k-th odometry."""

    def plant(connection: Connection) -> Connection:
        topic = connection.topics["/odom"]
        thin = {name: values[::k] for name, values in topic.columns.items()}
        return changed(connection, "/odom", received=topic.received[::k], columns=thin)

    return plant


def world(c: Any) -> Any:
    return (c["u"] + 1j * c["v"]) * np.exp(1j * c["psi"])


def renamed(connection: Connection) -> Connection:
    topic = connection.topics["/odom"]
    without = {**connection.topics, "/odom": topic._replace(publishers=(), received=np.empty(0), columns={})}
    return connection._replace(topics={**without, "/boat/odometry": Topic("/boat/odometry", topic.publishers)})


def simulated(connection: Connection) -> Connection:
    return connection._replace(simulated=("controller",))


def text(value: str) -> Callable[[Any], Any]:
    return lambda c: np.array([value] * len(c["frame"]), dtype=object)


def alternating(c: Any) -> Any:
    return np.array(["odom" if k % 2 else "map" for k in range(len(c["frame"]))], dtype=object)


def gap(t: Any) -> Any:
    return np.where(t > t[len(t) // 2], t + 2.0, t)


def second_half(values: Any) -> Any:
    return np.arange(len(values)) > len(values) // 2


def clock_set(size: float) -> Callable[[Connection], Connection]:
    """The clock here is set by a time, s."""

    def plant(connection: Connection) -> Connection:
        received = connection.topics["/odom"].received
        return changed(connection, "/odom", received=received + size * second_half(received))

    return plant


def held_from(share: float) -> Callable[[Connection], Connection]:
    """The motion of a moment is repeated for the rest of the time."""

    def rule(name: str) -> Callable[[Any], Any]:
        return lambda c: c[name][np.minimum(np.arange(len(c[name])), int(share * len(c[name])))]

    changes: Any = {name: rule(name) for name in ("x", "y", "psi", "u", "v", "r")}
    return columns(**changes)


ODOM = types.ODOMETRY
MISTAKES: dict[str, tuple[Callable[[Connection], Connection], str]] = {
    "another name": (renamed, "-r odom:=/boat/odometry"),
    "another type": (ends("/odom", publishers=(Endpoint("driver", types.POSE),)), "geometry_msgs/msg/PoseStamped at driver"),
    "nothing is sent": (ends("/odom", received=np.empty(0), columns={}), "no message came"),
    "reliability": (
        ends("/odom", publishers=(Endpoint("driver", ODOM, False),), readers=(Endpoint("controller", ODOM, True),)),
        "the reliability of driver and of controller is not compatible",
    ),
    "durability": (
        ends("/cmd_wrench", readers=(Endpoint("driver", types.WRENCH, True, True),)),
        "the durability of controller and of driver",
    ),
    "two sources": (ends("/odom", publishers=(Endpoint("ekf", ODOM), Endpoint("driver", ODOM))), "2 publishers, ekf, driver"),
    "a joystick": (
        ends("/cmd_wrench", publishers=(Endpoint("controller", types.WRENCH), Endpoint("joy", types.WRENCH))),
        "2 publishers, controller, joy",
    ),
    "no driver": (ends("/cmd_wrench", readers=()), "no node reads /cmd_wrench"),
    "driver of Twist": (ends("/cmd_wrench", readers=(Endpoint("driver", types.TWIST),)), "geometry_msgs/msg/Twist at driver"),
    "slow": (every(10), "Hz: it must have at least 5 Hz"),
    "gaps": (times(gap), "silent for 2"),
    "no stamps": (columns(stamp=lambda c: 0.0 * c["stamp"]), "no stamps (0)"),
    "old stamps": (columns(stamp=lambda c: c["stamp"] - 3.0), "s old, above the time-out"),
    "stamps a little old": (columns(stamp=lambda c: c["stamp"] - 0.6), "s old, above the time-out"),
    "clock ahead": (columns(stamp=lambda c: c["stamp"] + 3.0), "ahead of the clock here"),
    "clock a little ahead": (columns(stamp=lambda c: c["stamp"] + 0.15), "ahead of the clock here"),
    "stamps go back": (columns(stamp=lambda c: c["stamp"] - 0.1 * (np.arange(len(c["x"])) % 2)), "stamps that go back"),
    "some stamps go back": (
        columns(stamp=lambda c: c["stamp"] - 0.1 * (np.arange(len(c["x"])) % 40 == 7)),
        "stamps that go back",
    ),
    "stamps repeat": (columns(stamp=lambda c: np.repeat(c["stamp"][::2], 2)[: len(c["x"])]), "repeats its stamps"),
    "frame": (columns(frame=text("world")), "'world', and 'odom' or 'map' is accepted"),
    "child frame": (columns(child=text("imu_link")), "odometry.body_frames"),
    "NED by name": (columns(frame=text("map_ned")), "a frame of x north or z down"),
    "changing frame": (columns(frame=alternating), "changes between the frames"),
    "no orientation": (columns(norm=lambda c: 0.0 * c["norm"]), "orientations of zeros"),
    "angle as quaternion": (columns(norm=lambda c: 57.0 * c["norm"]), "is an angle in place of a quaternion"),
    "half a quaternion": (columns(norm=lambda c: 0.6 * c["norm"]), "is an angle in place of a quaternion"),
    "FRD body": (columns(up=lambda c: -c["up"]), "upside down"),
    "negative covariance": (columns(least_variance=lambda c: c["variance"] - 1.0), "covariances that are negative"),
    "a covariance that is not finite": (
        columns(variance=lambda c: np.where(np.arange(len(c["x"])) == 7, np.nan, c["variance"])),
        "covariances that are negative or not finite",
    ),
    "not finite": (columns(x=lambda c: c["x"] * np.nan), "not finite: x"),
    "degrees for positions": (
        columns(x=lambda c: 59.9 + c["x"] / 111e3, y=lambda c: 10.7 + c["y"] / 56e3),
        "latitude and longitude",
    ),
    "twist in the world": (columns(u=lambda c: world(c).real, v=lambda c: world(c).imag), "twist_frame: parent is for that"),
    "twist not filled in": (
        columns(u=lambda c: 0 * c["u"], v=lambda c: 0 * c["v"], r=lambda c: 0 * c["r"]),
        "is the twist not filled in?",
    ),
    "knots": (columns(u=lambda c: c["u"] / 0.51444, v=lambda c: c["v"] / 0.51444), "in knots?"),
    "km/h": (columns(u=lambda c: 3.6 * c["u"], v=lambda c: 3.6 * c["v"]), "in km/h?"),
    "degrees per second": (columns(r=lambda c: np.degrees(c["r"])), "in degrees per second?"),
    "yaw rate of FRD": (columns(r=lambda c: -c["r"]), "is the yaw rate positive to starboard (FRD)?"),
    "surge astern": (columns(u=lambda c: -c["u"]), "is u positive astern?"),
    "compass heading": (
        columns(psi=lambda c: 0.5 * math.pi - c["psi"], r=lambda c: -c["r"]),
        "course and heading turn in opposite directions",
    ),
    "NED positions": (columns(x=lambda c: c["y"], y=lambda c: c["x"]), "or are positions x north and y east?"),
    "heading from north": (columns(psi=lambda c: c["psi"] - 0.5 * math.pi), "does the heading count from north?"),
    "all NED": (
        columns(
            x=lambda c: c["y"],
            y=lambda c: c["x"],
            psi=lambda c: 0.5 * math.pi - c["psi"],
            v=lambda c: -c["v"],
            r=lambda c: -c["r"],
        ),
        "positive yaw moment drives to starboard",
    ),
    "drives reversed": (columns("/cmd_wrench", force=lambda c: -c["force"]), "positive surge force drives astern"),
    "steering reversed": (columns("/cmd_wrench", moment=lambda c: -c["moment"]), "positive yaw moment drives to starboard"),
    "local time": (columns(stamp=lambda c: c["stamp"] + 7200.0), "in local time?"),
    "local time of half hours": (columns(stamp=lambda c: c["stamp"] - 19800.0), "in local time?"),
    "the smallest zone and half a minute": (columns(stamp=lambda c: c["stamp"] - 1770.0), "in local time?"),
    "the largest zone and half a minute": (columns(stamp=lambda c: c["stamp"] + 50_430.0), "in local time?"),
    "GPS time": (columns(stamp=lambda c: c["stamp"] + 18.0), "GPS time, which is 18 s ahead of UTC"),
    "stamps since boot": (columns(stamp=lambda c: c["stamp"] - 1.7e9), "counted from a start, or of a simulation"),
    "stamps step ahead": (columns(stamp=lambda c: c["stamp"] + 5.0 * second_half(c["stamp"])), "of /odom have stepped by 5 s"),
    "stamps step back": (columns(stamp=lambda c: c["stamp"] - 0.4 * second_half(c["stamp"])), "of /odom have stepped by -0.4"),
    "clock set ahead": (clock_set(5.0), "the clock here has stepped by 5 s"),
    "clock set back": (clock_set(-5.0), "the clock here has stepped by -5 s"),
    "no position in the filter": (columns(variance=lambda c: c["variance"] + 1e6), "a standard deviation of 1e+03 m"),
    "latched command": (
        ends("/cmd_wrench", publishers=(Endpoint("test", types.WRENCH, True, True),)),
        "carries out its last message, however old",
    ),
    "command of another frame": (
        columns("/cmd_wrench", frame=lambda c: np.array(["map"] * len(c["force"]), dtype=object)),
        "is in 'map', and 'base_link' is accepted",
    ),
    "command in kN": (columns("/cmd_wrench", force=lambda c: 1e-3 * c["force"]), "e+02 times the effect of its number"),
    "moment of another ship": (columns("/cmd_wrench", moment=lambda c: 30.0 * c["moment"]), "times the effect of its number"),
    "repeated motion": (held_from(0.5), "does the driver repeat its last message?"),
    "corrected positions": (
        columns(x=lambda c: c["x"] + 3.0 * (np.arange(len(c["x"])) // 100 % 2)),
        "they jump, 11 times, by 3",
    ),
    "positions in mm": (columns(x=lambda c: 1e3 * c["x"], y=lambda c: 1e3 * c["y"]), "are the positions in mm?"),
    "feet per second": (columns(u=lambda c: c["u"] / 0.3048, v=lambda c: c["v"] / 0.3048), "in feet per second?"),
    "simulated time": (simulated, "no node publishes /clock"),
    "simulated time of a node that has ended": (
        lambda connection: simulated(connection)._replace(topics={**connection.topics, "/clock": Topic("/clock")}),
        "no node publishes /clock",
    ),
}
