"""Exact sampling instants in integer nanoseconds; every node derives its period from here."""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel

Instants = NDArray[np.int64]

NANOSECONDS = 1_000_000_000


class RateGrid:
    """The instants k/rate, k = 0, 1, 2, ... in nanoseconds, without drift for any rate.

    The ratio of a nanosecond to the period is kept as a fraction, so that 3 Hz has exactly three instants in every second.
    `rate_hz`: instants per second, above 0.
    """

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        self.period = 1.0 / rate_hz
        # A decimal rate such as 33.3 has no exact binary value; the nearest simple fraction is the rate that was meant.
        ratio = NANOSECONDS / Fraction(rate_hz).limit_denominator(10**6)
        self._numerator, self._denominator = ratio.numerator, ratio.denominator

    def stamp(self, index: int) -> int:
        """Time of instant `index` in nanoseconds, rounded down."""
        return index * self._numerator // self._denominator

    def index(self, nanoseconds: int) -> int:
        """Index of the last instant not after a time: stamp(index) <= nanoseconds < stamp(index + 1)."""
        # With p = numerator/denominator, floor(k·p) <= t is equivalent to k·numerator < (t + 1)·denominator, in integers.
        return (nanoseconds * self._denominator + self._denominator - 1) // self._numerator

    def stamps(self, count: int) -> Instants:
        """`stamp` of the first instants, (count,)."""
        index = np.arange(count, dtype=np.int64)
        whole, rest = divmod(self._numerator, self._denominator)
        # In two parts: index·numerator may exceed 64 bits.
        return index * whole + index * rest // self._denominator

    def indices(self, stamps: Instants) -> Instants:
        """`index` of times in nanoseconds that are not negative, of their shape."""
        count = self.index(int(stamps.max(initial=0))) + 1
        return np.searchsorted(self.stamps(count), stamps, side="right") - 1

    def divides(self, other: "RateGrid") -> bool:
        """Whether every instant of this grid is also an instant of the other."""
        # The ratio of the two periods is an integer.
        return (self._numerator * other._denominator) % (self._denominator * other._numerator) == 0


@kernel
def seconds(nanoseconds: int) -> float:
    """Convert nanoseconds to seconds; used by all parts, so that their times are bit-identical."""
    return nanoseconds * 1e-9
