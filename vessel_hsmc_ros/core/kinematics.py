"""Motion of a ship in the plane, angles, the error coordinates of the tracking problem, (9) to (11), and latitude and longitude.

| symbol | meaning | unit | equation |
|---|---|---|---|
| x, y | position in the earth-fixed frame | m | (6) |
| psi | heading, counter-clockwise from x | rad | (6) |
| u, v, r | surge, sway and yaw velocity in the body frame | m/s, m/s, rad/s | (6) |
| du, dv, dr | their time derivatives | m/s², m/s², rad/s² | (6) |
| z1, z2, z3 | position resolved along and across the hull, heading | m, m, rad | (9), (10) |
| dz1, dz2, dz3 | their first time derivatives | m/s, m/s, rad/s | (9) with (6) |
| ddz1, ddz2, ddz3 | their second time derivatives | m/s², m/s², rad/s² | (13), (18), (24) |

The state at one instant is a `Motion`, a series of states an array of shape (n, 6) with the same columns.

The plane of a datum, by geodesics of the WGS84 ellipsoid: a place is at x = s·sin(a), y = s·cos(a), s being the length of the
geodesic from the datum to it and a its azimuth there: an azimuthal equidistant projection, in which distance and direction from
the datum are exact. Within 10 km scale and angles are right to 1e-6. Away from the datum north is not along y but turned by the
convergence.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import kernel

TURN = 2.0 * math.pi  # a full turn
GRAVITY = 9.81  # acceleration of gravity, m/s²


class Motion(NamedTuple):
    """State of a ship by the symbols of (6): earth-fixed pose and body-fixed velocities."""

    x: float
    y: float
    psi: float
    u: float
    v: float
    r: float


class Acceleration(NamedTuple):
    """Time derivatives of the body velocities."""

    du: float
    dv: float
    dr: float


class Transformed(NamedTuple):
    """z1, z2, z3 of (9), or their derivatives."""

    z1: float
    z2: float
    z3: float


def as_motion(state: Iterable[float]) -> Motion:
    """The state x, y, psi, u, v, r, such as an array of shape (6,), as plain floats."""
    return Motion(*map(float, state))


def in_body_frame(motion: Motion) -> Motion:
    """The motion with its velocities, given along x and y of the earth-fixed frame, resolved along and across the hull, (6)."""
    u, v = to_body(motion.u, motion.v, motion.psi)
    return motion._replace(u=u, v=v)


def as_acceleration(acceleration: Iterable[float]) -> Acceleration:
    """The derivatives du, dv, dr, such as an array of shape (3,), as plain floats."""
    return Acceleration(*map(float, acceleration))


@kernel
def magnitude(x: float, y: float) -> float:
    """The length sqrt(x² + y²) of a horizontal vector."""
    return math.sqrt(x * x + y * y)


@kernel
def to_body(x: float, y: float, psi: float) -> tuple[float, float]:
    """A horizontal vector along x and y of the earth-fixed frame, resolved along and across a hull of heading psi."""
    c, s = math.cos(psi), math.sin(psi)
    return x * c + y * s, y * c - x * s


@kernel
def wrap(angle: float) -> float:
    """Map an angle to (-pi, pi]; an angle in that interval is returned unchanged (bit-identical)."""
    if -math.pi < angle <= math.pi:
        return angle
    # ceil instead of floor makes the interval half-open at -pi: an odd multiple of pi is mapped to +pi.
    return angle - TURN * math.ceil((angle - math.pi) / TURN)


@kernel
def quaternion_from_heading(psi: float) -> tuple[float, float]:
    """The z and w components of the unit quaternion for a rotation by psi about the vertical axis; x and y are zero."""
    return math.sin(0.5 * psi), math.cos(0.5 * psi)


@kernel
def heading_from_quaternion(x: float, y: float, z: float, w: float) -> float:
    """The yaw angle of a quaternion; roll and pitch are disregarded.

    `x`, `y`, `z`, `w`: components of any non-zero quaternion; it need not be normalised. Returns heading in [-pi, pi].
    """
    # Both arguments scale with the squared norm, which cancels; the usual 1 - 2·(y² + z²) would need a unit quaternion.
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def as_published(state: Iterable[float]) -> Motion:
    """The state as a subscriber of its message receives it.

    A message carries the heading as a quaternion, so it comes back wrapped to [-pi, pi] and rounded. The offline loop passes
    states through this function, which makes its runs bit-identical to those of the nodes.
    """
    return published(as_motion(state))


@kernel
def published(motion: Motion) -> Motion:
    """`as_published` of a motion."""
    z, w = quaternion_from_heading(motion.psi)
    psi = heading_from_quaternion(0.0, 0.0, z, w)
    return Motion(motion.x, motion.y, psi, motion.u, motion.v, motion.r)


@kernel
def transform(motion: Motion) -> Transformed:
    """Z of (9): z1 = x·cos psi + y·sin psi, z2 = -x·sin psi + y·cos psi, z3 = psi."""
    z1, z2 = to_body(motion.x, motion.y, motion.psi)
    return Transformed(z1, z2, motion.psi)


@kernel
def transform_rate(z: Transformed, motion: Motion) -> Transformed:
    """dZ, from (9) and (6): dz1 = u + z2·r, dz2 = v - z1·r, dz3 = r."""
    return Transformed(motion.u + z.z2 * motion.r, motion.v - z.z1 * motion.r, motion.r)


@kernel
def transform_acceleration(z: Transformed, motion: Motion, acceleration: Acceleration) -> Transformed:
    """ddZ, from (9) and (6): ddz1 = du + dz2·r + z2·dr, ddz2 = dv - dz1·r - z1·dr, ddz3 = dr.

    `motion`: pose and body velocities. `acceleration`: derivatives of the body velocities. Returns ddz1 [m/s²], ddz2 [m/s²],
    ddz3 [rad/s²].
    """
    u, v, r = motion.u, motion.v, motion.r
    du, dv, dr = acceleration
    return Transformed(du + (v - z.z1 * r) * r + z.z2 * dr, dv - (u + z.z2 * r) * r - z.z1 * dr, dr)


@kernel
def tracking_error(z: Transformed, z_d: Transformed) -> Transformed:
    """z_e = Z - Z_d of (11), with the heading error wrapped to (-pi, pi]."""
    return Transformed(z.z1 - z_d.z1, z.z2 - z_d.z2, wrap(z.z3 - z_d.z3))


@kernel
def extrapolate(motion: Motion, acceleration: Acceleration, interval: float) -> Motion:
    """The state a short interval later or earlier, with the body acceleration held constant.

    The velocities are exact for a constant acceleration; the pose is integrated by the midpoint rule. `acceleration`:
    derivatives of the body velocities, held over the interval. `interval`: time to extrapolate by, s; negative to go back in
    time; 0 returns the state unchanged. Returns state at the end of the interval; the heading is not wrapped.
    """
    if interval == 0.0:
        return motion
    du, dv, dr = acceleration
    end_u, end_v, end_r = motion.u + du * interval, motion.v + dv * interval, motion.r + dr * interval
    # Mean velocities over the interval, resolved at the heading in its middle.
    u, v, r = 0.5 * (motion.u + end_u), 0.5 * (motion.v + end_v), 0.5 * (motion.r + end_r)
    psi = motion.psi + 0.5 * interval * r
    c, s = math.cos(psi), math.sin(psi)
    return Motion(
        motion.x + interval * (u * c - v * s),
        motion.y + interval * (u * s + v * c),
        motion.psi + interval * r,
        end_u,
        end_v,
        end_r,
    )


FARTHEST = 50e3
"""Largest distance from the datum, m: one that is farther away is of another place, and scale and angles are not right there."""


SAME = 1e-7
"""Largest difference of two statements of one datum, degrees: a centimetre."""


class Place(NamedTuple):
    """A place in the plane."""

    # x, y: east and north of the datum, m
    x: float
    y: float
    # angle from east there to the x axis, clockwise, rad: what a heading counted from east has to be turned by
    convergence: float


class Plane:
    """The plane of a datum. `latitude`, `longitude`: of the datum, degrees; no pole."""

    def __init__(self, latitude: float, longitude: float) -> None:
        if not (abs(latitude) < 90.0 and abs(longitude) <= 360.0):
            raise ParameterError(
                "datum must be a latitude between -90 and 90 degrees, without the poles, and a longitude from -360 to 360 degrees"
                f" (got {latitude}, {longitude})"
            )
        from geographiclib.geodesic import Geodesic  # here: the command shows its help without the libraries of its verbs

        self.latitude, self.longitude, self._earth = latitude, longitude, Geodesic.WGS84

    def place(self, latitude: float, longitude: float) -> Place:
        """Where a latitude and a longitude are, degrees."""
        found = self._earth.Inverse(
            self.latitude, self.longitude, latitude, longitude, self._earth.DISTANCE | self._earth.AZIMUTH
        )
        s, azimuth = found["s12"], math.radians(found["azi1"])
        return Place(
            s * math.sin(azimuth), s * math.cos(azimuth), math.remainder(math.radians(found["azi2"] - found["azi1"]), TURN)
        )

    def distance(self, latitude: float, longitude: float) -> float:
        """Distance from the datum to a place, m."""
        return float(self._earth.Inverse(self.latitude, self.longitude, latitude, longitude, self._earth.DISTANCE)["s12"])

    def coordinates(self, x: float, y: float) -> tuple[float, float]:
        """Latitude and longitude, degrees, of a place x, y, m."""
        azimuth = math.degrees(math.atan2(x, y))
        found = self._earth.Direct(
            self.latitude, self.longitude, azimuth, math.hypot(x, y), self._earth.LATITUDE | self._earth.LONGITUDE
        )
        return found["lat2"], found["lon2"]


def same(one: Sequence[float], other: Sequence[float]) -> bool:
    """Whether two pairs of latitude and longitude, degrees, state one datum."""
    return abs(one[0] - other[0]) <= SAME and abs(math.remainder(one[1] - other[1], 360.0)) <= SAME


def exchanged(plane: Plane, latitude: float, longitude: float) -> bool:
    """Whether a place is near to the datum if latitude and longitude of the datum are exchanged."""
    return abs(plane.longitude) < 90.0 and Plane(plane.longitude, plane.latitude).distance(latitude, longitude) <= FARTHEST
