"""The conditions and bounds of the hierarchical law in closed form, docs/theory.md, against roots and simulated motions."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.laws.hierarchical_parameters import (
    MAX_DRIFT,
    PATIENCE,
    HierarchicalParameters,
    about,
    ball,
    circled,
    circling,
    decay,
    gains,
    rest_ratio,
    routh_ratio,
    sway_warning,
    turning_ratio,
)

SHIP = replace(KnownVessel(), **INSTANT)
G = gains(HierarchicalParameters(), SHIP, 0.02)

rates, ratios = st.floats(0.02, 3.0), st.floats(0.1, 2.0)


@given(rates, ratios, st.floats(0.2, 5.0), rates)
def test_a_straight_line_is_kept_exactly_where_both_ratios_exceed_one(D: float, K: float, lam: float, c: float) -> None:
    g = G._replace(c=c)
    routh, turning = routh_ratio(g, D, K, lam), turning_ratio(D, K, lam)
    if min(abs(routh - 1.0), abs(turning - 1.0)) < 1e-6:
        return
    roots = np.roots([lam, lam * D + 1.0 - K, D + c * (1.0 - K), c * D])
    assert (roots.real.max() < 0.0) == (min(routh, turning) > 1.0)


@given(rates, rates, st.floats(0.01, 3.0), st.floats(0.01, 2.0))
def test_the_bow_stays_in_the_wind_exactly_where_sway_is_damped_faster_than_errors_decay(D, c, lever, k) -> None:
    ratio = rest_ratio(G._replace(c=c), D)
    if abs(ratio - 1.0) > 1e-6:
        assert (np.roots([lever, lever * D, k, k * c]).real.max() < 0.0) == (ratio > 1.0)


@given(rates, ratios, st.floats(0.2, 5.0), st.floats(0.8, 1.2), st.floats(0.8, 1.2))
def test_the_ratios_of_a_box_contain_those_of_every_hull_in_it(D, K, lam, one, other) -> None:
    found = routh_ratio(G, about(D, 0.2), about(K, 0.2), lam)
    assert found.low <= routh_ratio(G, one * D, other * K, lam) <= found.high
    found = turning_ratio(about(D, 0.2), about(K, 0.2), lam)
    assert found.low <= turning_ratio(one * D, other * K, lam) <= found.high


@given(st.floats(0.0, 1.0))
def test_the_ball_is_the_error_at_which_the_field_outweighs_the_surfaces(s: float) -> None:
    d = ball(G, s)
    assert d == pytest.approx(2.0 * G.l0 + s / decay(G, d), rel=1e-9)
    for further in (1.1 * d, 3.0 * d):
        assert (further - 2.0 * G.l0) * decay(G, further) > s


@pytest.mark.parametrize("v", [0.005, 0.05, 0.5])
def test_the_circle_is_that_of_a_simulated_vessel_at_rest_whose_sway_drifts(v: float) -> None:
    """(z1, z2) of a vessel with S1 = S2 = 0 and the sway velocity v, which decays onto the circle."""
    z1, z2, h = 0.5 * G.l0, 0.2 * G.l0, 2e-3 / G.c
    for _ in range(20000):
        r = -(G.c * z2 + v) / G.l0
        z1, z2 = z1 + h * (-G.c * z1 + r * z2), z2 + h * (v - r * z1)
    assert math.hypot(z1, z2) == pytest.approx(circling(G, v), rel=0.02)


def test_the_circle_of_a_slow_drift_grows_with_its_cube_root() -> None:
    for v in (1e-5, 1e-4):
        assert circling(G, v) == pytest.approx((G.l0**2 * v / G.c) ** (1.0 / 3.0), rel=0.02)


def test_without_drift_there_is_no_circle() -> None:
    assert circling(G, 0.0) == 0.0


@pytest.mark.parametrize(
    ("declared", "warned"),
    [
        ({}, False),
        ({"sway_damping_rate": 0.83, "coriolis_ratio": 0.67}, False),
        ({"sway_damping_rate": 0.05, "coriolis_ratio": 1.0}, False),  # the rate c is then at most half of the damping rate
        ({"sway_damping_rate": 0.05}, False),
        ({"sway_damping_rate": 0.0, "coriolis_ratio": 0.5}, True),
        ({"sway_damping_rate": 0.83, "coriolis_ratio": 5.0}, True),
    ],
)
def test_a_declared_sway_that_the_law_does_not_master_is_named_with_its_ratio(declared: dict[str, Any], warned: bool) -> None:
    vessel = replace(SHIP, surge_inertia=1e5, sway_inertia=1.01e5, **declared)
    found = sway_warning(HierarchicalParameters(), vessel, 0.02)
    assert bool(found) == warned
    assert "the Routh ratio of the path error must be above 1 (got " in found or not warned


@given(
    st.floats(1.5, 6.0),
    st.floats(0.4, 1.0),
    st.floats(0.02, 0.3),
    st.floats(5.0, 300.0),
    st.sampled_from(["square", "sine", "half"]),
)
@settings(max_examples=25)
def test_no_varying_sway_force_drives_a_vessel_at_rest_further_than_the_bound(D, K, drive, period, shape) -> None:
    """The model of docs/theory.md with S1 = S2 = 0, in units of l0 and 1/c."""
    e1, e2, v, h, largest, count = 0.0, 1e-6, 0.0, 0.02, 0.0, 20000
    for i in range(count):
        wave = math.sin(2.0 * math.pi * i * h / period)
        force = {"square": math.copysign(1.0, wave), "sine": wave, "half": 0.5 + 0.5 * wave}[shape] * drive * (D - K)
        u, r = -e1, -(v + e2)
        e1, e2, v = e1 + h * (u + r * e2), e2 + h * (v - r * e1), v + h * (force - D * v - K * u * r)
        largest = max(largest, math.hypot(e1, e2))
    assert largest * G.l0 <= circled(G, drive * G.c * G.l0, 0.0)[0]


def test_a_drift_that_is_no_longer_slow_has_no_circle() -> None:
    assert math.isinf(circled(G, 1.01 * MAX_DRIFT * G.c * G.l0, 0.0)[0])


def test_what_is_left_at_rest_in_calm_water_is_what_the_model_reaches_in_a_hundred_units_of_time() -> None:
    e1, e2, h = 0.0, 0.5, 0.02
    for _ in range(round(PATIENCE / h)):
        r = -e2
        e1, e2 = e1 + h * (r * e2 - e1), e2 - h * r * e1
    assert math.hypot(e1, e2) * G.l0 <= circled(G, 0.0, 0.0)[0] <= 1.25 * math.hypot(e1, e2) * G.l0
