"""What the controller's diagnostics report of its supervision."""

from vessel_hsmc_ros.nodes.reporting import ERROR, OK, WARN, Concern
from vessel_hsmc_ros.safety.reasons import Operation
from vessel_hsmc_ros.safety.supervision import Supervision

LEVELS = {"ok": OK, "warn": WARN, "error": ERROR}
"""Diagnostics levels of reasons."""


def operation_status(supervision: Supervision) -> tuple[bytes, str]:
    """Level and message of the present operation: OK while the law commands."""
    if supervision.operation is Operation.ACTIVE:
        return OK, "running"
    return LEVELS[supervision.reason.level], f"{supervision.operation.name.lower()}: {supervision.reason.text}"


def guard_concern(supervision: Supervision) -> Concern:
    """The output guard: an error while a violation of it is the reason of the safe action."""
    counts = {reason.name.lower(): count for reason, count in supervision.violations.items()}
    broken = supervision.reason in supervision.violations
    return Concern("guard", ERROR if broken else OK, "violated" if broken else "no violation", counts)
