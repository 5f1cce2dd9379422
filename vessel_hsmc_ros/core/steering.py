"""The yaw moment that an outboard, a jet or a rudder has: it depends on thrust and on speed.

| symbol | meaning | unit |
|---|---|---|
| X, X_max | surge force and its limit | N |
| N_max | yaw moment at full thrust | N·m |
| s | share of it that is lost without thrust and way: 1 for an outboard, 0 for two propellers side by side | - |
| u, u_0 | surge speed, and that at which the rudder alone gives the full moment | m/s |

    |N| <= N_max·min(1, 1 - s + s·|X|/X_max + (u/u_0)²)

The thrust that is turned, or that blows at a rudder, gives a part in proportion to X; the flow at a rudder one with the square of
the speed, of which an outboard has none (u_0 infinite).
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import between, clip
from vessel_hsmc_ros.core.schema import parameter

LARGEST_BOOST = 0.3  # share of X_max up to which a law gives thrust for the sake of steering


def steering_loss() -> float:
    """Declare s; 0 by default."""
    return parameter(
        0.0,
        "Share of yaw_moment_limit that is lost without thrust and way: 1 for an outboard, less with a rudder behind a propeller"
        " that idles; 0: none, as with two propellers side by side.",
        low=0.0,
        high=1.0,
    )


def steering_speed() -> float:
    """Declare u_0; infinite by default."""
    return parameter(
        math.inf,
        "With steering_loss, the surge speed at which a rudder gives the full yaw moment without thrust; inf: no rudder.",
        unit="m/s",
        low=1e-3,
        high=math.inf,
    )


class Steering(NamedTuple):
    """The constants of the yaw moment."""

    loss: float  # s
    speed: float  # u_0, m/s
    # force, moment: X_max, N, and N_max, N·m
    force: float
    moment: float


def steering(loss: float, speed: float, force: float, moment: float) -> Steering:
    """The constants, in the order of their fields. Raises ParameterError if a loss has no limits to refer to."""
    if loss and not (math.isfinite(force) and math.isfinite(moment) and force > 0.0):
        raise ParameterError(
            f"steering_loss must be 0 without finite surge_force_limit and yaw_moment_limit (got {loss:g}, {force:g} N and"
            f" {moment:g} N·m)"
        )
    return Steering(loss, speed, force, moment)


@kernel
def moment_limit(force: float, u: float, s: Steering) -> float:
    """The largest yaw moment with a surge force, N, at a surge speed, m/s; N·m."""
    way = u / s.speed
    return s.moment * min(1.0, 1.0 - s.loss + s.loss * abs(force) / s.force + way * way)


@kernel
def available(force: float, moment: float, u: float, s: Steering) -> float:
    """The yaw moment of a demand that there is with a surge force at a surge speed."""
    return moment if s.loss == 0.0 else clip(moment, moment_limit(force, u, s))


@kernel
def steered(demand: tuple[float, float], u: float, s: Steering) -> tuple[float, float]:
    """The demand of a law that can be had: with as much thrust as its moment needs, and at most the moment of that thrust.

    Thrust for steering is at most LARGEST_BOOST, in the direction of the demand, ahead without one: without it a vessel at rest
    would never turn. `demand`: surge force, N, and yaw moment, N·m. `u`: surge speed, m/s.
    """
    if s.loss == 0.0:
        return demand
    way, size = u / s.speed, abs(demand[0])
    needed = s.force * (abs(demand[1]) / s.moment - (1.0 - s.loss) - way * way) / s.loss
    size = between(needed, size, max(size, LARGEST_BOOST * s.force))
    force = -size if demand[0] < 0.0 else size
    return force, clip(demand[1], moment_limit(force, u, s))
