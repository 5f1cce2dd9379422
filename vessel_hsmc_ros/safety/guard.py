"""The output guard: the last check of a command, which knows nothing of the law that computed it."""

import math

from vessel_hsmc_ros.safety.reasons import Reason

Pair = tuple[float, float]

ROUNDING = 1.0 + 1e-9
"""What a law that clips to a limit in other units may exceed it by."""


def violation(command: Pair, previous: Pair, limits: Pair, rates: Pair, period: float) -> Reason:
    """The first rule that a command violates: finite, within its limits, within its rates.

    Args:
        command: Surge force and yaw moment, N and N·m.
        previous: The command before.
        limits: Largest values; infinite for none.
        rates: Largest changes per second; infinite for none.
        period: Time between the two commands, s.

    Returns:
        NONE, COMMAND_NOT_FINITE, COMMAND_LIMIT or COMMAND_RATE.
    """
    if not (math.isfinite(command[0]) and math.isfinite(command[1])):
        return Reason.COMMAND_NOT_FINITE
    if abs(command[0]) > limits[0] * ROUNDING or abs(command[1]) > limits[1] * ROUNDING:
        return Reason.COMMAND_LIMIT
    changes = abs(command[0] - previous[0]), abs(command[1] - previous[1])
    if changes[0] > rates[0] * period * ROUNDING or changes[1] > rates[1] * period * ROUNDING:
        return Reason.COMMAND_RATE
    return Reason.NONE
