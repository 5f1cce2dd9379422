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
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.laws.guided_parameters import Gains


@kernel
def pivot_ahead(reference_squared: float, g: Gains) -> float:
    """Distance x of the pivot ahead of the controlled point, x_p/(1 + (U_d/U_s)⁴): under way the pivot itself is controlled.

    Args:
        reference_squared: U_d², m²/s².
        g: Gains.
    """
    ratio = reference_squared / (g.U_s * g.U_s)
    return g.x_p / (1.0 + ratio * ratio)


@kernel
def pivoting_rate(w_n: float, v_p: float, x: float, g: Gains) -> float:
    """The yaw rate (v_p - w_n)/(x + rho), at which the point rho behind the origin moves across the hull at w_n.

    Args:
        w_n: Velocity command across the hull, m/s.
        v_p: Sway velocity of the pivot, m/s.
        x: Distance of the pivot ahead of the controlled point, m.
        g: Gains.
    """
    return clip((v_p - w_n) / (x + g.rho), g.r_max)


@kernel
def nearness(square: float, g: Gains) -> float:
    """Weight of station keeping, 1/(1 + (W/W_0)⁴), for W²: from 1 near the setpoint to 0 far from it or under way."""
    ratio = square / (g.W_0 * g.W_0)
    return 1.0 / (1.0 + ratio * ratio)
