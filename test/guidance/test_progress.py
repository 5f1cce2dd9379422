"""The leg that a vessel is on, and the way that is left."""

import cmath
import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.guidance.tasks import Progress

pytestmark = pytest.mark.pure
places = st.complex_numbers(max_magnitude=100.0, allow_nan=False, allow_infinity=False)


def sailed(progress: Progress, line: list[complex], step: float = 0.5) -> list[tuple[int, float]]:
    """Legs and ways left of a vessel that sails along a line."""
    found = []
    for a, b in pairwise(line):
        for k in range(max(1, math.ceil(abs(b - a) / step))):
            position = a + (b - a) * min(1.0, k * step / abs(b - a)) if b != a else a
            progress.advance(position)
            found.append((progress.leg, progress.distance_left(position)))
    progress.advance(line[-1])
    return [*found, (progress.leg, progress.distance_left(line[-1]))]


@pytest.mark.long
@settings(deadline=None)
@given(start=places, points=st.lists(places, min_size=1, max_size=12))
def test_a_vessel_on_the_legs_is_on_the_last_one_at_the_end_with_no_way_left(start: complex, points: list[complex]) -> None:
    progress = Progress(start, points, room=1.0)
    seen = sailed(progress, [start, *points])
    legs = [leg for leg, _ in seen]
    assert legs == sorted(legs)
    assert seen[-1][1] == pytest.approx(
        abs(points[progress.leg - 1] - points[-1]) if progress.leg < len(points) else 0.0, abs=1e-6
    )
    assert all(left >= 0.0 for _, left in seen)


def test_a_survey_is_counted_leg_by_leg() -> None:
    points = [100 + 0j, 100 + 10j, 0 + 10j, 0 + 20j, 100 + 20j]
    progress = Progress(0j, points, room=2.0)
    seen = sailed(progress, [0j, *points])
    assert {leg for leg, _ in seen} == {1, 2, 3, 4, 5}
    assert seen[0][1] == pytest.approx(320.0)
    assert seen[-1] == (5, 0.0)


def test_a_corner_that_is_cut_is_passed_where_the_vessel_crosses_the_line_that_halves_it() -> None:
    progress = Progress(0j, [20 + 0j, 20 + 20j], room=1.0)
    progress.advance(14 + 2j)
    assert progress.leg == 1
    progress.advance(17 + 3.1j)
    assert progress.leg == 2


def test_a_way_back_on_the_same_line_begins_at_its_corner() -> None:
    progress = Progress(0j, [50 + 0j, 0j], room=1.0)
    progress.advance(49 + 0j)
    assert progress.leg == 1
    progress.advance(50.1 + 0j)
    assert progress.leg == 2


@pytest.mark.parametrize("aside", [0.0, 0.6])
def test_dense_points_are_passed_in_the_order_of_the_vessel(aside: float) -> None:
    circle = [20j + 20 * cmath.exp(1j * (math.tau * k / 2000 - 0.5 * math.pi)) for k in range(1, 2001)]
    progress = Progress(0j, circle, room=2.0)
    for k in range(0, 2001, 60):
        position = 20j + (20 + aside) * cmath.exp(1j * (math.tau * k / 2000 - 0.5 * math.pi))
        progress.advance(position)
        assert abs(progress.leg - k) < 120
        assert progress.distance_left(position) == pytest.approx((2000 - k) * 20 * math.tau / 2000, abs=3.0)
