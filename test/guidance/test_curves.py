"""Curves: the position is the integral of the course, the course that of the curvature; they close."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.guidance.curves import CORNER_EXTENT, Arc, Curve, FigureEight, Square, course, position

CURVES = [Arc(0.0), Arc(0.05), FigureEight(60.0), Square(40.0, 6.0)]
H = 1e-4

curves = pytest.mark.parametrize("curve", CURVES, ids=["line", "circle", "figure eight", "square"])


def positions(curve: Curve, s: np.ndarray) -> np.ndarray:
    return np.array([position(one, curve.constants) for one in s])


@curves
def test_a_curve_begins_at_the_origin_along_the_x_axis(curve: Curve) -> None:
    assert position(0.0, curve.constants) == 0.0
    assert course(0.0, curve.constants) == 0.0
    assert float(curve.curvature(H)) >= 0.0


@curves
def test_course_curvature_and_its_slope_are_the_derivatives_of_the_position(curve: Curve) -> None:
    s = np.linspace(0.1, 300.0, 701)
    courses = np.array([course(one, curve.constants) for one in s])
    tangent = (positions(curve, s + H) - positions(curve, s - H)) / (2.0 * H)
    np.testing.assert_allclose(tangent, np.exp(1j * courses), atol=1e-8)
    turned = np.array([course(one + H, curve.constants) - course(one - H, curve.constants) for one in s])
    np.testing.assert_allclose(curve.curvature(s), turned / (2.0 * H), atol=1e-8)
    np.testing.assert_allclose(curve.curvature_slope(s), (curve.curvature(s + H) - curve.curvature(s - H)) / (2.0 * H), atol=1e-8)


@curves
def test_curvature_and_its_slope_are_continuous(curve: Curve) -> None:
    s = np.linspace(0.0, 300.0, 30_001)
    for values in (curve.curvature(s), curve.curvature_slope(s)):
        assert np.abs(np.diff(values)).max() <= 0.01 * max(np.ptp(values), 1e-12) + 1e-15


@pytest.mark.parametrize(
    ("curve", "lap"), [(Arc(0.05), 40.0 * math.pi), (FigureEight(60.0), FigureEight(60.0).period)], ids=["circle", "figure eight"]
)
def test_a_closed_curve_returns_to_its_start(curve: Curve, lap: float) -> None:
    assert abs(position(lap, curve.constants)) < 1e-12
    assert abs(position(1000.0 * lap, curve.constants)) < 1e-8


def test_a_square_returns_to_its_start_after_four_corners_and_is_as_wide_as_its_side() -> None:
    square = Square(40.0, 6.0)
    assert abs(position(4.0 * square.period, square.constants)) < 1e-12
    assert course(4.0 * square.period, square.constants) == pytest.approx(2.0 * math.pi)
    path = positions(square, np.linspace(0.0, 4.0 * square.period, 4001))
    assert [path.real.min(), path.real.max(), path.imag.min(), path.imag.max()] == pytest.approx([-20.0, 20.0, 0.0, 40.0])
    assert np.max(square.curvature(np.linspace(0.0, square.period, 10_001))) == pytest.approx(1.0 / 6.0)


def test_a_square_whose_corners_touch_has_no_straight_part() -> None:
    square = Square(40.0, 20.0 / CORNER_EXTENT)
    assert square.period == pytest.approx(square.shortest_bend, abs=1e-12)


def test_the_length_of_a_figure_eight_is_that_of_its_long_axis_and_it_crosses_itself_at_the_start() -> None:
    eight = FigureEight(60.0)
    path = positions(eight, np.linspace(0.0, eight.period, 4001))
    along = path * np.exp(-1j * math.radians(47.785))
    assert np.ptp(along.real) == pytest.approx(60.0, abs=1e-3)
    assert np.ptp(along.imag) == pytest.approx(22.2, abs=0.1)
    assert abs(position(0.5 * eight.period, eight.constants)) < 1e-12
