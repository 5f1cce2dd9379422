"""Interval arithmetic: it contains every result of its operands, as an independent implementation finds it."""

import math
from collections.abc import Callable

import mpmath
import pytest
from durations import rest_long
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.laws.hierarchical_parameters import Interval, about
from vessel_hsmc_ros.core.exceptions import ParameterError

numbers = st.floats(-1e6, 1e6)
shares = st.floats(0.0, 1.0)
OPERATIONS: dict[str, Callable] = {
    "sum": lambda a, b: a + b,
    "difference": lambda a, b: a - b,
    "product": lambda a, b: a * b,
    "quotient": lambda a, b: a / b,
    "with numbers": lambda a, b: 2.0 - 3.0 * a + 1.0 / b,
}


def between(bounds: Interval, share: float) -> float:
    return min(max(bounds.low + share * (bounds.high - bounds.low), bounds.low), bounds.high)


@pytest.mark.parametrize("name", rest_long(OPERATIONS, 3))
@given(*[numbers] * 4, shares, shares)
def test_a_result_contains_those_of_all_numbers_and_the_one_of_another_implementation(name, p, q, s, t, one, other) -> None:
    a, b = Interval(min(p, q), max(p, q)), Interval(min(s, t), max(s, t))
    if b.low <= 1e-3 and b.high >= -1e-3:  # not a divisor
        b = Interval(b.high + 1.0, b.high + 2.0) if b.high >= 0.0 else Interval(1.0, 2.0)
    found = OPERATIONS[name](a, b)
    assert found.low <= OPERATIONS[name](between(a, one), between(b, other)) <= found.high
    wanted = OPERATIONS[name](mpmath.iv.mpf([a.low, a.high]), mpmath.iv.mpf([b.low, b.high]))
    size = 1e-9 * (1.0 + abs(p) + abs(q)) * (1.0 + abs(s) + abs(t))
    assert found.low == pytest.approx(float(wanted.a), rel=1e-12, abs=size)
    assert found.high == pytest.approx(float(wanted.b), rel=1e-12, abs=size)


@given(numbers, numbers, shares)
def test_a_square_is_never_negative_and_contains_those_of_all_numbers(p, q, share) -> None:
    a = Interval(min(p, q), max(p, q))
    found = a.squared()
    assert 0.0 <= found.low <= between(a, share) ** 2 <= found.high


def test_a_divisor_that_may_be_zero_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"the divisor must not contain zero \(got -1 to 2\)"):
        1.0 / Interval(-1.0, 2.0)


def test_a_share_about_a_negative_value_is_in_order() -> None:
    found = about(-10.0, 0.2)
    assert found.low == pytest.approx(-12.0)
    assert found.high == pytest.approx(-8.0)
    assert math.isfinite((-found).low)
