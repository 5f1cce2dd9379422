"""The plane of a datum beside an independent computation, at all latitudes and at the date line."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import Plane

A, F = 6378137.0, 1.0 / 298.257223563
E2 = F * (2.0 - F)

DATUMS = [(0.0, 0.0), (59.9, 10.7), (-33.9, 151.2), (89.5, 12.0), (-89.5, -170.0), (10.0, 179.99), (-17.0, -179.99)]


def earth_centred(latitude: float, longitude: float) -> np.ndarray:
    phi, lam = math.radians(latitude), math.radians(longitude)
    n = A / math.sqrt(1.0 - E2 * math.sin(phi) ** 2)
    return np.array([n * math.cos(phi) * math.cos(lam), n * math.cos(phi) * math.sin(lam), n * (1.0 - E2) * math.sin(phi)])


def tangent(datum: tuple[float, float], latitude: float, longitude: float) -> np.ndarray:
    """East and north in the tangent plane of a datum, through Earth-centred coordinates."""
    phi, lam = map(math.radians, datum)
    d = earth_centred(latitude, longitude) - earth_centred(*datum)
    east = np.array([-math.sin(lam), math.cos(lam), 0.0])
    north = np.array([-math.sin(phi) * math.cos(lam), -math.sin(phi) * math.sin(lam), math.cos(phi)])
    return np.array([east @ d, north @ d])


@pytest.mark.parametrize("datum", DATUMS)
@given(x=st.floats(-1e4, 1e4), y=st.floats(-1e4, 1e4))
def test_a_place_within_ten_kilometres_returns_to_within_a_micrometre(datum: tuple[float, float], x: float, y: float) -> None:
    plane = Plane(*datum)
    found = plane.place(*plane.coordinates(x, y))
    assert found[:2] == pytest.approx((x, y), abs=1e-6)


@pytest.mark.parametrize("datum", DATUMS)
@given(x=st.floats(-500.0, 500.0), y=st.floats(-500.0, 500.0))
def test_near_the_datum_it_is_the_tangent_plane(datum: tuple[float, float], x: float, y: float) -> None:
    """The chord of an arc of 700 m is 4e-7 m shorter, and its middle lies 0.01 m above it."""
    assert tangent(datum, *Plane(*datum).coordinates(x, y)) == pytest.approx((x, y), abs=2e-6)


def geodesic(latitude: float, azimuth: float, length: float) -> np.ndarray:
    """End of a geodesic by its differential equations: latitude, change of longitude, azimuth, rad."""

    def slope(state: np.ndarray) -> np.ndarray:
        phi, _, alpha = state
        w = 1.0 - E2 * math.sin(phi) ** 2
        m, n = A * (1.0 - E2) / w**1.5, A / math.sqrt(w)
        return np.array([math.cos(alpha) / m, math.sin(alpha) / (n * math.cos(phi)), math.tan(phi) * math.sin(alpha) / n])

    state, h = np.array([math.radians(latitude), 0.0, azimuth]), length / 100.0
    for _ in range(100):
        k1 = slope(state)
        k2 = slope(state + 0.5 * h * k1)
        k3 = slope(state + 0.5 * h * k2)
        k4 = slope(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state


@pytest.mark.parametrize("latitude", [0.0, 1e-6, 30.0, -33.9, 59.9, -60.0, 80.0, -85.0, 89.0, -89.0])
@pytest.mark.parametrize("longitude", [0.0, 10.7, 179.99, -179.99, 180.0, -180.0, 359.9])
def test_ten_kilometres_away_it_is_the_integral_of_the_geodesic_to_a_micrometre(latitude: float, longitude: float) -> None:
    x, y = 7e3 * math.sin(latitude + longitude), -7e3 * math.cos(2.0 * latitude - longitude)
    plane, azimuth = Plane(latitude, longitude), math.atan2(x, y)
    phi, turned, alpha = geodesic(latitude, azimuth, math.hypot(x, y))
    found = plane.coordinates(x, y)
    n = A / math.sqrt(1.0 - E2 * math.sin(phi) ** 2)
    east = n * math.cos(phi) * math.remainder(math.radians(found[1] - longitude) - turned, 2.0 * math.pi)
    assert (east, A * (math.radians(found[0]) - phi)) == pytest.approx((0.0, 0.0), abs=1e-6)
    for longitude_there in (found[1], found[1] - math.copysign(360.0, found[1])):
        place = plane.place(found[0], longitude_there)
        assert place[:2] == pytest.approx((x, y), abs=1e-6)
        assert place.convergence == pytest.approx(alpha - azimuth, abs=1e-11)


def test_the_published_distance_of_a_minute_of_latitude() -> None:
    assert Plane(45.0, 0.0).place(45.0 + 1.0 / 60.0, 0.0)[:2] == pytest.approx((0.0, 1852.2), abs=0.2)


@pytest.mark.parametrize(("latitude", "sign"), [(60.0, 1.0), (-60.0, -1.0), (0.0, 0.0)])
def test_the_convergence_is_the_change_of_longitude_times_the_sine_of_the_latitude(latitude: float, sign: float) -> None:
    place = Plane(latitude, 10.0).place(latitude, 10.1)
    assert place.convergence == pytest.approx(math.radians(0.1) * math.sin(math.radians(latitude)), rel=1e-4, abs=1e-12)


@pytest.mark.parametrize("datum", [(90.0, 0.0), (-90.0, 0.0), (91.0, 0.0), (math.nan, 0.0), (0.0, math.inf)])
def test_a_datum_at_a_pole_or_nowhere_is_an_error(datum: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match="without the poles"):
        Plane(*datum)


@pytest.mark.parametrize(("latitude", "longitude"), [(10.0, 360.0), (10.0, -360.0), (89.999, 10.0), (-89.999, 10.0)])
def test_the_limits_of_a_datum_are_whole_turns_and_the_poles(latitude: float, longitude: float) -> None:
    Plane(latitude, longitude)
    beyond = (latitude, math.copysign(360.001, longitude)) if abs(longitude) == 360.0 else (math.copysign(90.0, latitude), 0.0)
    with pytest.raises(ParameterError, match="datum must be a latitude"):
        Plane(*beyond)
