"""Numbers as people write them."""

import pytest

from vessel_hsmc_ros.core.quantities import quantity, scaled


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2e5, "N", "200 kN"),
        (3e6, "N·m", "3 MN·m"),
        (250.0, "N·m", "250 N·m"),
        (0.00075, "m", "0.75 mm"),
        (0.12, "m", "0.12 m"),
        (0.05, "m", "50 mm"),
        (1234.0, "m", "1.23 km"),
        (35e-6, "s", "35 µs"),
        (1234.0, "s", "1234 s"),
        (-1234.0, "N", "-1.23 kN"),
        (999.9996, "N", "1 kN"),
        (12.345, "°", "12.3°"),
        (99.96, "%", "100 %"),
        (40001, "", "40001"),
        (0.0, "N", "0 N"),
        (-0.0, "N", "0 N"),
        (-1234.5, "", "-1234"),
        (3.2e-16, "m", "3.2e-16 m"),
        (1e30, "m", "1e+30 m"),
        (float("inf"), "N", "–"),
    ],
)
def test_a_quantity_has_three_significant_digits_and_a_prefix(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


def test_a_difference_has_its_sign() -> None:
    assert [quantity(value, "m", sign=True) for value in (0.005, -3.0, 0.0)] == ["+5 mm", "-3 m", "0 m"]


def test_an_axis_takes_the_prefix_of_its_largest_value() -> None:
    assert scaled(250.0, "N·m") == (1.0, "N·m")
    assert scaled(-3e6, "N·m") == (1e-6, "MN·m")
    assert scaled(0.003, "m") == (1e3, "mm")
