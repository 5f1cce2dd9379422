"""The tank runs of CyberShip Enterprise I: its thrust curves, its published hull data, and the calibration of its inputs."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.studies.identification.types import Measurements, smooth

Array = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[1] / "data" / "enterprise1"
USED, HELD_OUT = "main_surge_run2", "random_run4"

PUBLISHED = {
    "surge_inertia": 16.79,
    "sway_inertia": 24.79,
    "yaw_inertia": 2.76,
    "sway_yaw_inertia": 14.79 * 0.0375,
    "surge_damping": 0.6555,
    "surge_damping_quadratic": -0.3545,
    "surge_damping_cubic": 3.787,
    "surge_damping_from_sway": 2.443,
    "sway_damping": 1.33,
    "sway_damping_quadratic": 2.776,
    "sway_damping_cubic": 64.91,
    "sway_damping_from_yaw": 7.25,
    "sway_damping_from_yaw_quadratic": 3.45,
    "sway_damping_at_yaw": 0.805,
    "sway_damping_from_yaw_at_sway": 0.845,
    "yaw_damping_from_sway_quadratic": 0.2088,
    "yaw_damping": 1.9,
    "yaw_damping_quadratic": 0.75,
    "yaw_damping_from_sway_at_yaw": -0.13,
    "yaw_damping_at_sway": -0.08,
}
"""Hull data of the archive; those of yaw were taken over from CyberShip II."""

AHEAD, SIDEWAYS, BOW = (1.115, 0.401), (0.516, 0.628), 2.148
"""Thrust in bollard pull: k2·|p|p + k1·p, N, of one propeller ahead and sideways; N of the bow thruster at a limit of 0.5.

Fitted to the archive's force measurements (10 prev work/2014 Tran/Matlab: VSPsurge, VSPsway, BowThruster)."""
LEVERS = (0.055, 0.425, 0.415)
"""Propellers off the centre line, propellers aft, bow thruster ahead of the origin, m."""
GEOMETRY = np.array(
    [
        [1.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 1.0, 1.0],
        [LEVERS[0], -LEVERS[1], -LEVERS[0], -LEVERS[1], LEVERS[2]],
    ]
)
"""Surge force, sway force and yaw moment by the five thrusts, towards starboard and clockwise."""
OFFSET = ("yaw_moment_offset",)
"""Estimated as well: the starboard propeller turns more slowly than the other one (Tran 2014, section 3.2)."""
TO_PORT = np.array([1.0, -1.0, -1.0])


class TankRun(NamedTuple):
    """A run, without its wrench, and the thrusts of its five inputs, (n, 5), N."""

    motion: Measurements
    thrusts: Array

    def measurements(self, inputs: Array) -> Measurements:
        """The run with the wrench of an input matrix, (3, 5)."""
        return self.motion._replace(wrench=self.thrusts @ inputs.T * TO_PORT)


def tank_run(name: str) -> TankRun:
    """Read one of the runs."""
    time, north, east, heading, *u, limit = np.loadtxt(DATA / f"{name}.csv", delimiter=",", skiprows=1).T
    pose = np.column_stack([north, east, heading]) * TO_PORT
    thrusts = [curve(u[0], AHEAD), curve(u[1], SIDEWAYS), curve(u[2], AHEAD), curve(u[3], SIDEWAYS), BOW * u[4] * limit / 0.5]
    motion = Measurements(time - time[0], pose, np.full(pose.shape, np.nan), np.zeros(pose.shape), name)
    return TankRun(motion, np.column_stack(thrusts))


def curve(pitch: Array, coefficients: tuple[float, float]) -> Array:
    """Thrust by relative pitch, N."""
    return coefficients[0] * np.abs(pitch) * pitch + coefficients[1] * pitch


def calibrated(run: TankRun) -> Array:
    """The input matrix, (3, 5), with what each input does sideways and to the yaw moment in a run.

    The pitch servos are coupled, so thrust ahead also acts sideways. A regression of the smoothed accelerations on thrusts and
    velocities shows it; the propellers' sideways thrusts keep their measured size and lever, and thereby the scale.
    """
    smoothed = smooth(run.motion)
    (u, v, r), (_, dv, dr), one = smoothed.velocity.T, smoothed.acceleration.T, np.ones(len(run.thrusts))
    sway = _by_thrusts(run, -(dv + u * r), [v, np.abs(v) * v, u * r, r, one])
    yaw = _by_thrusts(run, -dr, [u * v, r, v, np.abs(r) * r, np.abs(v) * v, one])
    inputs = GEOMETRY.copy()
    inputs[1] = sway / sway[[1, 3]].mean()
    inputs[2] = -LEVERS[1] * yaw / yaw[[1, 3]].mean()
    return inputs


def _by_thrusts(run: TankRun, acceleration: Array, others: list[Array]) -> Array:
    """Coefficients of the five thrusts, (5,), in a regression that has other columns as well."""
    columns = np.column_stack([run.thrusts, *others])
    return np.asarray(np.linalg.lstsq(columns, acceleration, rcond=None)[0][:5])
