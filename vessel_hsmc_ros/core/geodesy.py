"""Latitude and longitude, and the plane of a datum: geodesics of the WGS84 ellipsoid, by GeographicLib.

A place is at x = s·sin(a), y = s·cos(a), s being the length of the geodesic from the datum to it and a its azimuth there: an
azimuthal equidistant projection, in which distance and direction from the datum are exact. Within 10 km scale and angles
are right to 1e-6. Away from the datum north is not along y but turned by the convergence.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import TURN

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
    """The plane of a datum.

    `latitude`, `longitude`: of the datum, degrees; no pole. Raises ParameterError if there is no such place, or it is a pole,
    where there is no north.
    """

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
