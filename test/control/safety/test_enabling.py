"""A controller must not be enabled with the hull of another ship, nor towards a reference that no one means."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.safety.samples import distance_problem, hull_problem
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.hull import kept
from vessel_hsmc_ros.core.kinematics import Motion

BOAT = {
    "length": 4.0,
    "surge_inertia": 550.0,
    "sway_inertia": 700.0,
    "yaw_inertia": 700.0,
    "surge_force_limit": 300.0,
    "yaw_moment_limit": 250.0,
}


def problem(values: dict[str, float | str]) -> str:
    return hull_problem(schema.build(KnownVessel, values, "vessel"), [f"vessel.{name}" for name in values])


@given(names=st.sets(st.sampled_from(sorted(BOAT))))
def test_a_boat_is_enabled_with_all_of_its_hull_data_only(names: set[str]) -> None:
    found = problem({name: BOAT[name] for name in names})
    if len(names) == len(BOAT):
        assert found == ""
    elif names:
        assert "only a part of the hull is given" in found
        assert all(f"vessel.{name} = " in found for name in BOAT.keys() - names)
    else:
        assert "no parameter describes the vessel" in found


def test_the_data_of_a_boat_are_those_that_describe_a_hull() -> None:
    assert kept(KnownVessel()).keys() == BOAT.keys()


@pytest.mark.parametrize(
    ("values", "fits"),
    [
        ({"name": "otter"}, True),
        ({"name": "paper_ship"}, True),
        ({"length": 32.0}, True),
        ({"surge_inertia": 130e3, "surge_force_limit": 2.5e5}, True),
        ({**BOAT, "yaw_moment_limit": 3e6}, True),
        ({"surge_lag": 1.0}, False),
        ({"sway_damping_rate": 0.1}, False),
        ({"surge_force_limit": 300.0}, False),
    ],
)
def test_what_a_vessel_is_known_by_decides(values: dict[str, float | str], fits: bool) -> None:
    assert (problem(values) == "") is fits


UTM = Motion(597_000.0, 6_640_000.0, 0.0, 0.0, 0.0, 0.0)
HERE = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("distance", "length", "limit", "fits"),
    [
        (399.0, 4.0, -1.0, True),
        (401.0, 4.0, -1.0, False),
        (401.0, 5.0, -1.0, True),
        (9.9, 4.0, 10.0, True),
        (10.1, 4.0, 10.0, False),
        (0.0, 4.0, 0.0, True),
        (1e7, 4.0, math.inf, True),
    ],
)
def test_a_reference_is_meant_within_a_distance(distance: float, length: float, limit: float, fits: bool) -> None:
    for angle in (0.0, 2.0, -1.0):
        reference = HERE._replace(x=distance * math.cos(angle), y=distance * math.sin(angle))
        assert (distance_problem(HERE, reference, length, limit) == "") is fits


def test_odometry_in_utm_is_named_with_both_places_and_the_bound() -> None:
    text = distance_problem(UTM, HERE, 4.0, -1.0)
    assert "the reference at (0, 0) m is 6.66678e+06 m from the vessel at (597000, 6.64e+06) m" in text
    assert "must be within safety.enable_distance = 400 m" in text
