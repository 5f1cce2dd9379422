"""What the actuators make of a law's commands: dead time, lag and rate limit as the law knows them, and the lead against the lag.

| symbol | meaning | unit |
|---|---|---|
| tau_c | commanded force or moment, within its limit | N, N·m |
| tau | modelled force or moment that acts on the hull during a period | N, N·m |
| tau_w | force or moment that the law wants to act | N, N·m |
| T, T_l, T_f | control period, lag, and the lag that remains with the lead | s |
| n | dead time in periods | - |

    tau(k) = tau(k-1) + clip((1 - exp(-T/T_l))·(tau_c(k-n) - tau(k-1)), rate·T)

With the command tau_c = tau + (1 - exp(-T/T_f))/(1 - exp(-T/T_l))·(tau_w - tau) the actuator approaches tau_w with the lag T_f
instead of T_l, as far as limit and rate allow.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import clip

LARGEST_CHANGE = 1e30
"""Change within a period of an actuator without a rate limit; finite, so that no product with it is undefined."""


class Channel(NamedTuple):
    """The known dynamics of one input in discrete time."""

    limit: float  # largest magnitude
    share: float  # 1 - exp(-T/T_l), the share of a step that is completed in a period
    boost: float  # (1 - exp(-T/T_f))/(1 - exp(-T/T_l)), at least 1
    change: float  # largest change in a period
    delay: int  # dead time in periods, n


def channel(limit: float, lag: float, remaining: float, rate: float, dead_time: float, period: float) -> Channel:
    """The constants of an input.

    `lag`, `remaining`: T_l and T_f <= T_l, s. `rate`: largest rate of change, per second; infinite for none. `dead_time`: dead
    time, s, which is rounded to whole periods. `period`: T, s.
    """
    share, fast = (1.0 if constant == 0.0 else -math.expm1(-period / constant) for constant in (lag, remaining))
    return Channel(limit, share, fast / share, min(rate * period, LARGEST_CHANGE), round(dead_time / period))


@kernel
def lead(tau: float, demand: float, c: Channel) -> float:
    """The command that drives the input from tau towards a demand faster than its lag."""
    if c.share == 1.0:
        return clip(demand, c.limit)
    return clip(tau + c.boost * (demand - tau), c.limit)


@kernel
def applied(tau: float, command: float, c: Channel) -> float:
    """The force or moment that acts in the next period, for the command that arrives at its beginning."""
    if c.share == 1.0 and abs(command - tau) <= c.change:
        return command
    return tau + clip(c.share * (command - tau), c.change)


@kernel
def arriving(queue: Array, row: int, head: int, age: int) -> float:
    """The command of a number of periods ago.

    `queue`: the last commands, a row for each input, shape (2, n + 1). `head`: column of the present period. `age`: number of
    periods, at most n.
    """
    column = head - age
    return float(queue[row, column if column >= 0 else column + queue.shape[1]])
