"""Hulls for tests, by the symbols of the equations; what is not named is zero."""

from typing import Any

from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.plant.dynamics import Vessel
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters

NAMES = {entry.symbol: name for name, entry in entries(ShipParameters).items() if entry.symbol and "." not in name}
"""Names of the parameters by their symbols."""


def ship(**values: Any) -> ShipParameters:
    """Hull data by symbols such as m11 and d_y_vr, and other parameters by their names."""
    zeros = dict.fromkeys(NAMES.values(), 0.0)
    return ShipParameters(**(zeros | {NAMES.get(name, name): value for name, value in values.items()}))


def hull(**symbols: float) -> Vessel:
    """Coefficients by symbols such as m11 and d_y_vr."""
    return ship(**symbols).coefficients()


BOAT_SYMBOLS = {
    **{"m11": 525.0, "m22": 700.0, "m33": 700.0, "d_u": 50.0, "d_v": 200.0, "d_r": 300.0},
    **{"d_u2": 30.0, "d_v2": 100.0, "d_r2": 100.0},
}
BOAT = hull(**BOAT_SYMBOLS)
"""A boat of 4 m with diagonal matrices."""

CYBERSHIP_2 = {
    **{"m11": 25.8, "m22": 33.8, "m33": 2.76, "m23": 1.0948},
    **{"d_u": 0.72253, "d_u2": 1.32742, "d_u3": 5.86643},
    **{"d_v": 0.88965, "d_v2": 36.47287, "d_y_r": 7.25, "d_y_vr": 0.845, "d_y_rv": 0.805, "d_y_rr": 3.45},
    **{"d_n_v": -0.0313, "d_n_vv": -3.95645, "d_r": 1.9, "d_n_vr": -0.08, "d_n_rv": -0.13, "d_r2": 0.75},
}
"""CyberShip II by Skjetne, Smogeli and Fossen (2004), Modeling, Identification and Control 25(1):3-27."""

MILLIAMPERE = {
    **{"m11": 2389.657, "m22": 2533.911, "m23": 62.386, "m32": 28.141, "m33": 5068.910},
    **{"d_u": 27.632, "d_u2": 110.064, "d_u3": 13.965, "d_v": 52.947, "d_v2": 116.486, "d_v3": 24.313},
    **{"d_y_r": -24.372, "d_y_vr": -572.141, "d_y_rv": 1540.383, "d_y_rr": 115.457},
    **{"d_n_v": -3.524, "d_n_vv": 0.832, "d_n_rv": -336.827, "d_r": 122.860, "d_r2": 874.428, "d_n_vr": 121.957},
}
"""milliAmpere by Pedersen (2019), with m23 and m32 that differ."""

COUPLING: dict[str, Any] = {
    **{"sway_yaw_inertia": 4e5, "yaw_sway_inertia": 2e5, "surge_damping_from_sway": 5e3, "surge_damping_from_sway_yaw": 2e4},
    **{"sway_damping_from_yaw": 3e5, "sway_damping_from_yaw_quadratic": 2e5, "sway_damping_from_yaw_at_sway": 1e5},
    **{"sway_damping_from_yaw_at_surge": -5e4, "sway_damping_at_yaw": 4e4, "sway_damping_at_surge": 2e4},
    **{"yaw_damping_from_sway": 2e5, "yaw_damping_from_sway_quadratic": 1e5, "yaw_damping_from_sway_at_yaw": 3e5},
    **{"yaw_damping_from_sway_at_surge": 1e5, "yaw_damping_at_sway": 5e5, "yaw_damping_at_surge": 1e6},
}
"""Parameters that give the paper's ship all coupling terms of the class."""
