"""A delay of whole periods: the last values in a ring buffer, which kernels write in place."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel

EMPTY = -1  # index of the last row before the first


class DelayLine(NamedTuple):
    """The values of the last periods, arrays that are written in place."""

    rows: NDArray[np.float64]  # values of a period each, shape (n, k), of delays up to n - 1 periods
    last: NDArray[np.int64]  # index of the row of the last period, shape (1,)


def delay_line(periods: int, width: int) -> DelayLine:
    """A line that is empty.

    `periods`: the longest delay, periods. `width`: number of values of a period.
    """
    return DelayLine(np.zeros((periods + 1, width)), np.full(1, EMPTY))


def whole_periods(delay: float, period: float) -> int:
    """The number of periods that is closest to a delay; both in s."""
    return round(delay / period)


@kernel
def put(line: DelayLine, values: Any) -> None:
    """Write the values of this period in the place of the oldest ones.

    `values`: as many as the line is wide; a tuple.
    """
    i = (line.last[0] + 1) % len(line.rows)
    line.last[0] = i
    for j in range(len(values)):
        line.rows[i, j] = values[j]


@kernel
def fill(line: DelayLine, values: Any) -> None:
    """Write the values of this period as if they had been the same in all periods before; the arguments are those of `put`."""
    for i in range(len(line.rows)):
        for j in range(len(values)):
            line.rows[i, j] = values[j]
    line.last[0] = 0


@kernel
def delayed(line: DelayLine, periods: int, column: int) -> float:
    """The value of some periods ago.

    `periods`: the delay, 0 for this period.
    """
    return float(line.rows[(line.last[0] - periods) % len(line.rows), column])
