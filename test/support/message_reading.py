"""Values from messages that no node reads: what tests compare."""

from typing import Any

from vessel_hsmc_ros.control.interface.law import Terms

CONTROL_FIELDS = (*Terms._fields, "compute_time", "missed_periods")


def read_disturbance(message: Any) -> tuple[float, float, float]:
    """Surge force, sway force and yaw moment of a wrench message."""
    return message.wrench.force.x, message.wrench.force.y, message.wrench.torque.z


def read_acceleration(message: Any) -> tuple[float, float, float]:
    """Surge, sway and yaw acceleration of an acceleration message."""
    return message.accel.linear.x, message.accel.linear.y, message.accel.angular.z


def read_control_state(message: Any) -> dict[str, Any]:
    """The values of a control-state message by their names."""
    return {name: getattr(message, name) for name in CONTROL_FIELDS}
