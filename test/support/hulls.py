"""Hulls for tests, by the symbols of the equations; what is not named is zero."""

from typing import Any

from vessel_hsmc_ros.core.schema import entries
from vessel_sim_node.plant import ShipParameters, Vessel

NAMES = {entry.symbol: name for name, entry in entries(ShipParameters).items() if entry.symbol}
"""Names of the parameters by their symbols."""


def ship(ranges: dict[str, Any] | None = None, **symbols: float) -> ShipParameters:
    """Hull data by symbols such as m11 and d_y_vr, with the ranges of the speeds by their names."""
    return ShipParameters(**{name: symbols.get(symbol, 0.0) for symbol, name in NAMES.items()}, **(ranges or {}))


def hull(**symbols: float) -> Vessel:
    """Coefficients by symbols such as m11 and d_y_vr."""
    return ship(**symbols).coefficients()


BOAT = hull(m11=525.0, m22=700.0, m33=700.0, d_u=50.0, d_v=200.0, d_r=300.0, d_u2=30.0, d_v2=100.0, d_r2=100.0)
"""A boat of 4 m with diagonal matrices."""
