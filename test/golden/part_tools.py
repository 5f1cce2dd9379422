"""What the recorded parts share: their period, a hull with all coupling terms, and the choice of the rows that are kept."""

from collections.abc import Sequence
from typing import Any

from vessel_hsmc_ros.core import schema

Rows = list[list[float]]

PERIOD = 0.1

COUPLED: dict[str, Any] = {
    **{"sway_yaw_inertia": 4e5, "yaw_sway_inertia": 2e5, "surge_damping_from_sway": 5e3, "surge_damping_from_sway_yaw": 2e4},
    **{"sway_damping_from_yaw": 3e5, "sway_damping_from_yaw_quadratic": 2e5, "sway_damping_from_yaw_at_sway": 1e5},
    **{"sway_damping_from_yaw_at_surge": -5e4, "sway_damping_at_yaw": 4e4, "sway_damping_at_surge": 2e4},
    **{"yaw_damping_from_sway": 2e5, "yaw_damping_from_sway_quadratic": 1e5, "yaw_damping_from_sway_at_yaw": 3e5},
    **{"yaw_damping_from_sway_at_surge": 1e5, "yaw_damping_at_sway": 5e5, "yaw_damping_at_surge": 1e6},
}


def built(cls: type[Any], **values: Any) -> Any:
    """Parameters by their dotted names, with two underscores for a dot."""
    return schema.build(cls, {name.replace("__", "."): value for name, value in values.items()}, "parts")


def thinned(rows: Sequence[Sequence[float]], count: int = 16) -> Rows:
    """Some of the rows, denser at the beginning; the last is one of them."""
    chosen = sorted({round((len(rows) - 1) * (k / (count - 1)) ** 1.5) for k in range(count)})
    return [[float(f"{value:.12g}") for value in rows[k]] for k in chosen]
