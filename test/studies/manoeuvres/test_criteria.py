"""The criteria of the IMO resolution."""

import pytest

from vessel_hsmc_ros.studies.manoeuvres.page import criteria, overshoot_limits


@pytest.mark.parametrize(
    ("passage", "first", "second"),
    [(5.0, 10.0, 25.0), (10.0, 10.0, 25.0), (20.0, 15.0, 32.5), (30.0, 20.0, 40.0), (90.0, 20.0, 40.0)],
)
def test_the_limits_of_the_overshoots_depend_on_length_and_speed(passage: float, first: float, second: float) -> None:
    assert overshoot_limits(passage) == (first, second)


def test_lengths_are_limited_in_ship_lengths() -> None:
    limits = {(each.manoeuvre, each.metric): each.limit for each in criteria(200.0, 8.0)}
    assert limits["turning_circle", "advance"] == 900.0
    assert limits["turning_circle", "tactical_diameter"] == 1000.0
    assert limits["zigzag_10", "initial_turning_distance"] == 500.0
    assert limits["zigzag_10", "first_overshoot"] == 17.5
    assert limits["zigzag_20", "first_overshoot"] == 25.0
    assert limits["crash_stop", "track_reach"] == 3000.0
