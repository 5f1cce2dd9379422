"""Station keeping of a ship whose yaw moment turns it about a pivot ahead of the origin, and the heading in calm water.

| symbol | meaning | unit |
|---|---|---|
| x_p | distance of the pivot ahead of the origin | m |
| v_p | sway velocity of the pivot, v + x_p·r, which the yaw moment does not accelerate | m/s |
| rho | lever arm of station keeping: here the held point is that far behind the origin | m |
| w_n | velocity command across the hull | m/s |
| W | magnitude of the velocity command | m/s |
| W_0 | the same at which station keeping takes over from the approach | m/s |
"""

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.laws.guided_parameters import Gains


@kernel
def pivoting_rate(w_n: float, motion: Motion, g: Gains) -> float:
    """The yaw rate (v_p - w_n)/(x_p + rho), at which the point rho behind the origin moves across the hull at w_n.

    Args:
        w_n: Velocity command across the hull, m/s.
        motion: State of the ship.
        g: Gains.
    """
    return clip((motion.v + g.x_p * motion.r - w_n) / (g.x_p + g.rho), g.r_max)


@kernel
def nearness(square: float, g: Gains) -> float:
    """Weight of station keeping, 1/(1 + (W/W_0)⁴), for W²: from 1 near the setpoint to 0 far from it or under way."""
    ratio = square / (g.W_0 * g.W_0)
    return 1.0 / (1.0 + ratio * ratio)
