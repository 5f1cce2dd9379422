"""Rules for the sensors of `navsat_odom`: fixes, what accompanies them, and the odometry beside them."""

import math
from collections.abc import Iterator

import numpy as np

from vessel_hsmc_ros.safety.connection import WRONG, Connection, Finding, Topic

NO_FIX = -1
"""The status of sensor_msgs/NavSatStatus without a fix; -2 is unknown, which drivers have that do not fill it in."""


def judge_sensors(connection: Connection) -> Iterator[Finding]:
    """Mistakes of fixes and of what accompanies them."""
    for name, rule in (("fix", judge_fix), ("fix_2", judge_fix), ("imu", judge_imu), ("course", judge_course)):
        topic = connection.of(name)
        if topic is not None:
            yield from (Finding(WRONG, name, text) for text in rule(topic))
    fix, odometry = connection.of("fix"), connection.of("odometry", "pose")
    if fix is not None and odometry is not None and mirrored(fix, odometry):
        text = "the odometry is a mirror image of the fixes: x north and y east (NED) in place of x east and y north"
        yield Finding(WRONG, "odometry", f"{text}: let the driver publish ENU, such as MAVROS' local_position/odom")


def judge_fix(topic: Topic) -> Iterator[str]:
    """That a receiver has a fix, at latitude and longitude."""
    c = topic.columns
    if (c["status"] == NO_FIX).mean() > 0.5:
        yield f"{topic.name} has no satellite fix (status {int(c['status'][-1])}): antenna, cable, sky"
        return
    latitude, longitude = float(np.median(c["latitude"])), float(np.median(c["longitude"]))
    if abs(latitude) > 90.0 or abs(longitude) > 360.0:
        yield f"{topic.name} is at {latitude:.6g}, {longitude:.6g}: are latitude and longitude, in degrees, exchanged or scaled?"
    elif abs(latitude) < 1e-3 and abs(longitude) < 1e-3:
        yield f"{topic.name} is at 0, 0: its publisher fills in no position, or radians"


def judge_imu(topic: Topic) -> Iterator[str]:
    """That an IMU stands upright and measures in radians."""
    c = topic.columns
    if float(np.median(c["az"])) < -4.0:
        yield f"{topic.name} measures {np.median(c['az']):.3g} m/s² upwards at rest: it is FRD; it takes FLU, where that is 9.8"
    if float(np.max(np.abs(c["r"]))) > 2.0 * math.pi:
        yield f"{topic.name} has a yaw rate of {np.max(np.abs(c['r'])):.3g}: it takes rad/s, not degrees"


def judge_course(topic: Topic) -> Iterator[str]:
    """That a course is in radians."""
    largest = float(np.max(np.abs(topic.columns["value"])))
    if largest > 2.0 * math.pi + 0.01:
        yield f"{topic.name} has values to {largest:.4g}: it takes rad clockwise from north, not degrees"


def mirrored(fix: Topic, odometry: Topic) -> bool:
    """Whether positions turn the other way round than the fixes: the best map of displacements has a negative determinant."""
    if len(odometry.received) < 4 or len(fix.received) < 4:
        return False
    t = odometry.received
    phi = math.radians(float(np.median(fix.columns["latitude"])))
    east = np.radians(np.interp(t, fix.received, fix.columns["longitude"])) * math.cos(phi) * 6378137.0
    north = np.radians(np.interp(t, fix.received, fix.columns["latitude"])) * 6378137.0
    world, local = (
        np.array(p) - np.mean(p, axis=1, keepdims=True) for p in ((east, north), (odometry.columns["x"], odometry.columns["y"]))
    )
    values = np.linalg.svd(local @ world.T)[1]
    # Along a straight line a rotation and a mirror image fit alike.
    return bool(values[1] > 0.02 * values[0] and np.linalg.det(local @ world.T) < 0.0)
