"""Electric power that the propulsion takes, and the battery that it comes from.

| symbol | meaning | unit |
|---|---|---|
| s, m | surge force and yaw moment, as shares of their limits | - |
| P_0, P_1 | power of all else, power at full thrust | W |
| F, U | largest surge force, top speed | N, m/s |

At a constant advance ratio the thrust of a propeller grows with the square of its shaft speed, and its power with the cube, by
the affinity laws: P is proportional to T^(3/2). Two propellers that share the surge force and turn by their difference take

    P = P_0 + P_1/2·(|s + m|^(3/2) + |s - m|^(3/2))

A vessel with a rudder or an azimuth turns without a difference: m = 0. Where the power at full thrust is not declared, it is
estimated as P_1 = F·U/eta, with the efficiency eta from the battery to the thrust.
"""

from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.schema import parameter

EFFICIENCY = 0.4  # eta: 0.5 of the propeller and 0.8 of motor and electronics, as is usual for small electric boats


@dataclass(frozen=True)
class PowerParameters:
    """What the vessel takes from its battery, for forecasts; nothing of it has a part in the motion."""

    full_thrust: float = parameter(
        0.0,
        "Electric power at full thrust, for forecasts; 0 estimates it from the top speed.",
        unit="W",
        low=0.0,
        high=1e9,
        symbol="P_1",
    )
    other: float = parameter(
        0.0,
        "Electric power of all else, such as computers and sensors, for forecasts.",
        unit="W",
        low=0.0,
        high=1e9,
        symbol="P_0",
    )
    battery_wh: float = parameter(
        0.0, "Usable capacity of the battery, for forecasts; 0 for not known.", unit="W·h", low=0.0, high=1e12
    )


def electric_power(surge: Array, yaw: Array, full_thrust: float, other: float) -> Array:
    """The power P, (n,) W.

    `surge`, `yaw`: s and m, (n,); m is 0 where the vessel does not turn by a difference of thrusts. `full_thrust`, `other`: P_1
    and P_0, W.
    """
    shares: Array = 0.5 * (np.abs(surge + yaw) ** 1.5 + np.abs(surge - yaw) ** 1.5)
    return other + full_thrust * shares
