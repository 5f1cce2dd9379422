"""Polygons of a fence: their checks, and the distance of a way from their sides, against an independent library."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.fence import MAX_CORNERS, Fence, FenceParameters, allowed, clearance, fence_of
from vessel_hsmc_ros.core.schema import build

SQUARE = (0.0, 0.0, 10.0, 0.0, 10.0, 10.0, 0.0, 10.0, 0.0, 0.0)
ISLAND = (4.0, 4.0, 6.0, 4.0, 6.0, 6.0, 4.0, 6.0, 4.0, 4.0)
HARBOUR = FenceParameters(inside=SQUARE, outside=ISLAND)


def fence(p: FenceParameters) -> Fence:
    found = fence_of(p, "fence")
    assert found is not None
    return found


def star(center: complex, radii: Sequence[float]) -> list[complex]:
    """A polygon that does not cross itself: corners at equal angles about its centre."""
    return [center + r * np.exp(2j * math.pi * k / len(radii)) for k, r in enumerate(radii)]


def numbers(ring: Sequence[complex]) -> tuple[float, ...]:
    return tuple(value for p in (*ring, ring[0]) for value in (p.real, p.imag))


def test_without_areas_and_a_distance_from_home_there_is_no_fence() -> None:
    assert fence_of(FenceParameters(), "fence") is None


@pytest.mark.parametrize(
    ("way", "room"),
    [
        ([2 + 5j], 2.0),  # the side x = 0 is as near as the island
        ([1 + 5j], 1.0),
        ([3 + 3j], math.sqrt(2.0)),
        ([1 + 1j, 9 + 1j], 1.0),
        ([1 + 5j, 9 + 5j], 0.0),  # through the island
        ([5 + 1j, 5 + 11j], 0.0),  # out of the square
        ([5 + 12j], -2.0),
        ([5 + 5j], -1.0),
    ],
)
def test_a_way_has_the_room_that_a_drawing_shows(way: list[complex], room: float) -> None:
    assert clearance(fence(HARBOUR), np.array([way[0], way[-1]])) == pytest.approx(room)


@given(
    st.integers(-9, 9),
    st.lists(st.sampled_from([1.0, 2.0, 3.7, 10.0]), min_size=3, max_size=8),
    st.integers(0, 7),
    st.floats(1.0, 9.0),
    st.floats(0.0, 9.0),
)
def test_a_way_through_a_corner_of_an_area_to_stay_out_of_crosses_it(
    x: int, radii: list[float], corner: int, before: float, after: float
) -> None:
    ring = star(complex(x), radii)
    out = ring[corner % len(ring)] - x
    way = np.array([x + before * out, x - after * out])
    assert clearance(fence(FenceParameters(outside=numbers(ring))), way) <= 0.0


def test_the_vessel_may_be_inside_of_all_areas_and_outside_of_the_others() -> None:
    assert [allowed(fence(HARBOUR), p) for p in (1 + 1j, 5 + 5j, -1 + 5j, 11 + 5j)] == [True, False, False, False]
    both = fence(FenceParameters(inside=SQUARE + ISLAND))
    assert [allowed(both, p) for p in (1 + 1j, 5 + 5j)] == [False, True], "of several areas in all of them"


def test_the_largest_distance_from_home_is_a_circle() -> None:
    circle = fence(FenceParameters(home=(100.0, 50.0), home_distance=20.0))
    assert allowed(circle, 119 + 50j)
    assert not allowed(circle, 100 + 71j)
    assert clearance(circle, np.array([100 + 50j] * 2)) == pytest.approx(20.0, rel=2e-3)


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (SQUARE[:-1], r"fence\.inside must have x and y of each corner \(got 9 numbers\)"),
        (SQUARE[:-2], r"fence\.inside, polygon 1, must end with its first corner, \(0, 0\) \(got \(0, 10\)\)"),
        ((*SQUARE, 1.0, 1.0, 2.0, 2.0), r"polygon 2, must end with its first corner, \(1, 1\) \(got \(2, 2\)\)"),
        ((0.0, 0.0, 1.0, 1.0, 0.0, 0.0), r"fence\.inside, polygon 1, must have at least 3 corners \(got 2\)"),
        ((0.0, 0.0, 9.0, 9.0, 9.0, 0.0, 0.0, 9.0, 0.0, 0.0), r"must not cross or touch itself \(got sides 1 and 3"),
        ((0.0, 0.0, 9.0, 0.0, 4.0, 0.0, 0.0, 0.0), r"must not cross or touch itself \(got sides"),
        ((0.0, 0.0, 9.0, 0.0, 9.0, 0.0, 0.0, 9.0, 0.0, 0.0), r"must not cross or touch itself \(got sides"),
    ],
)
def test_a_polygon_that_is_none_is_refused_with_its_values(inside: tuple[float, ...], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        fence_of(FenceParameters(inside=inside), "fence")


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e9])
def test_a_corner_that_is_no_place_is_refused_with_its_value(value: float) -> None:
    with pytest.raises(ParameterError, match=r"fence\.inside must be a list of finite numbers .*\(got \["):
        build(FenceParameters, {"inside": [0.0, 0.0, 1.0, value, 1.0, 1.0, 0.0, 0.0]}, "fence")


@pytest.mark.long
def test_a_fence_of_too_many_corners_is_refused() -> None:
    ring = star(0j, [100.0] * (MAX_CORNERS + 1))
    with pytest.raises(ParameterError, match=f"fence must have at most {MAX_CORNERS} corners"):
        fence_of(FenceParameters(inside=numbers(ring)), "fence")


radius = st.floats(0.5, 50.0)
place = st.builds(complex, st.floats(-60.0, 60.0), st.floats(-60.0, 60.0))


@pytest.mark.long
@given(
    st.lists(radius, min_size=3, max_size=9),
    st.lists(radius, min_size=3, max_size=6),
    place,
    st.lists(place, min_size=2, max_size=5),
)
def test_drawn_ways_keep_from_drawn_polygons_as_an_independent_library_says(
    radii: list[float], others: list[float], center: complex, way: list[complex]
) -> None:
    shapely = pytest.importorskip("shapely")
    inside, outside = star(0j, radii), star(center, others)
    found = clearance(fence(FenceParameters(numbers(inside), numbers(outside))), np.array(way))
    polygons = [shapely.Polygon([(p.real, p.imag) for p in ring]) for ring in (inside, outside)]
    line = shapely.LineString([(p.real, p.imag) for p in way])
    begin = shapely.Point(way[0].real, way[0].imag)
    sides = shapely.unary_union([polygon.exterior for polygon in polygons])
    within = polygons[0].contains(begin) and not polygons[1].intersects(begin)
    expected = line.distance(sides) if within else -begin.distance(sides)
    assert found == pytest.approx(expected, abs=1e-9)
