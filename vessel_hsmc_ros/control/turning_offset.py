"""An angle that varies with the turns of the reference, learned from the tracking error of the origin.

| symbol | meaning | unit |
|---|---|---|
| e | tracking error of the origin across the reference's heading, in terms of the point's distance x | - |
| o | angle by which the reference's point is turned about the origin | rad |
| lambda | bandwidth of the regressors, max(abs(nu_d), U_0)/L | rad/s |
| a, b, c | the reference's yaw rate after one, two and three first-order lags | rad/s |
| phi1, phi2 | regressors a - b and a - 3·b + 2·c; at the frequency lambda they are a quarter of a period apart | rad/s |
| theta1, theta2 | coefficients | s |
| p0 | size of the regressors below which they are taken for noise, NOISE·lambda | rad/s |

    o = theta1·phi1 + theta2·phi2,    dtheta = -SPEED·lambda·phi·e/(phi1² + phi2² + p0²)

A hull whose sway is coupled to its yaw needs another heading than the reference's, which varies as the reference turns. The
filter of the headings follows it late, and so does the law; what is late in a slalom returns with every turn, and the
angle o, which moves the origin across by x·o, cancels it. Both regressors vanish in a steady turn and on a straight path:
there nothing is learned and o = 0.
"""

from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import clip

SPEED, NOISE, MAX_COEFFICIENT = 0.5, 0.1, 0.25
"""Rate of learning in terms of lambda; p0 in terms of lambda; |theta| at most this divided by p0."""

NEAR = 0.25
"""Error, in terms of x, beyond which nothing is learned: the ship is then on its way to the reference."""


class Turning(NamedTuple):
    """State: lagged yaw rates of the reference, and coefficients."""

    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    theta1: float = 0.0
    theta2: float = 0.0


class Offset(NamedTuple):
    """O with its first and second derivative, and the state for the next period."""

    o: float
    do: float
    ddo: float
    turning: Turning


@kernel
def turning_offset(turning: Turning, e: float, r_d: float, dr_d: float, rate: float, T: float) -> Offset:
    """The angle and what is learned in a period.

    The derivatives are those for constant coefficients, which change slowly compared with the regressors.

    Args:
        turning: The state.
        e: Tracking error of the origin in terms of x.
        r_d, dr_d: Yaw rate and yaw acceleration of the reference, rad/s, rad/s².
        rate: lambda, rad/s, below 1/T.
        T: Control period, s.
    """
    a, b, c, theta1, theta2 = turning
    da, db, dc = rate * (r_d - a), rate * (a - b), rate * (b - c)
    dda, ddb, ddc = rate * (dr_d - da), rate * (da - db), rate * (db - dc)
    phi1, phi2 = a - b, a - 3.0 * b + 2.0 * c
    o = theta1 * phi1 + theta2 * phi2
    do = theta1 * (da - db) + theta2 * (da - 3.0 * db + 2.0 * dc)
    ddo = theta1 * (dda - ddb) + theta2 * (dda - 3.0 * ddb + 2.0 * ddc)
    p0 = NOISE * rate
    step = SPEED * rate * T * e / (phi1 * phi1 + phi2 * phi2 + p0 * p0) if -NEAR < e < NEAR else 0.0
    largest = MAX_COEFFICIENT / p0
    theta1, theta2 = clip(theta1 - step * phi1, largest), clip(theta2 - step * phi2, largest)
    return Offset(o, do, ddo, Turning(a + T * da, b + T * db, c + T * dc, theta1, theta2))
