"""Interval arithmetic: sums, products and quotients of numbers that are only known to lie between two bounds.

Each bound is rounded outwards by one unit in the last place, so that the result contains every value that the operands allow.
An expression in which a quantity occurs twice gives an interval that is too wide, never one that is too narrow.

Source: R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval Analysis, SIAM 2009.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from vessel_hsmc_ros.core.exceptions import ParameterError


@dataclass(frozen=True)
class Interval:
    """All numbers from `low` to `high`."""

    low: float
    high: float

    def __add__(self, other: Interval | float) -> Interval:
        o = interval(other)
        return _outwards(self.low + o.low, self.high + o.high)

    def __radd__(self, other: float) -> Interval:
        return self + other

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval | float) -> Interval:
        return self + (-interval(other))

    def __rsub__(self, other: float) -> Interval:
        return interval(other) - self

    def __mul__(self, other: Interval | float) -> Interval:
        o = interval(other)
        products = [a * b for a in (self.low, self.high) for b in (o.low, o.high)]
        return _outwards(min(products), max(products))

    def __rmul__(self, other: float) -> Interval:
        return self * other

    def __truediv__(self, other: Interval | float) -> Interval:
        """The quotient. Raises ParameterError if the divisor contains zero."""
        o = interval(other)
        if o.low <= 0.0 <= o.high:
            raise ParameterError(f"the divisor must not contain zero (got {o.low:g} to {o.high:g})")
        quotients = [a / b for a in (self.low, self.high) for b in (o.low, o.high)]
        return _outwards(min(quotients), max(quotients))

    def __rtruediv__(self, other: float) -> Interval:
        return interval(other) / self

    def squared(self) -> Interval:
        """The squares, which the product with itself would take for the products of two numbers."""
        low, high = sorted((abs(self.low), abs(self.high)))
        least = 0.0 if self.low <= 0.0 <= self.high else low * low
        return Interval(max(0.0, math.nextafter(least, -math.inf)), math.nextafter(high * high, math.inf))


def interval(value: Interval | float) -> Interval:
    """A number as an interval."""
    return value if isinstance(value, Interval) else Interval(value, value)


def about(value: float, share: float) -> Interval:
    """The numbers within a share of a value, such as 0.2 for 20 %."""
    return interval(value) * Interval(1.0 - share, 1.0 + share)


def _outwards(low: float, high: float) -> Interval:
    return Interval(math.nextafter(low, -math.inf), math.nextafter(high, math.inf))
