"""The parameters of freshness, plausibility, monitors and safe action.

What a controller commands, and why: the codes of ControlState and their texts.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass
from enum import IntEnum

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.fence import FenceParameters
from vessel_hsmc_ros.core.schema import group, parameter


class Operation(IntEnum):
    """What a controller does; a person commands it, except for SAFE."""

    STANDBY = 0
    ACTIVE = 1
    SAFE = 2
    STOPPED = 3


class Reason(IntEnum):
    """Why an input is refused, or why the command is not the law's; `text` is a phrase, `level` ok, warn or error."""

    text: str
    level: str

    def __new__(cls, code: int, text: str, level: str) -> "Reason":
        """A reason with its text and level."""
        reason = int.__new__(cls, code)
        reason._value_, reason.text, reason.level = code, text, level
        return reason

    NONE = 0, "the command is the law's", "ok"
    NOT_RECEIVED = 1, "never received", "warn"
    OVERDUE = 2, "not received for its time-out", "error"
    STAMP_OLD = 3, "its stamp is older than its time-out", "error"
    STAMP_FUTURE = 4, "its stamp is ahead of the clock", "error"
    DUPLICATE = 5, "its stamp is that of the last one", "warn"
    OUT_OF_ORDER = 6, "its stamp is before that of the last one", "warn"
    WRONG_FRAME = 7, "it is in another frame", "error"
    NOT_FINITE = 8, "it is not finite", "error"
    UNCERTAIN = 9, "its covariance is above its limit", "error"
    JUMP = 10, "it shows a motion that no ship makes", "warn"
    IN_STANDBY = 20, "not activated", "ok"
    IN_STOP = 21, "stopped until it is rearmed", "warn"
    NOT_READY = 22, "not enough fresh inputs yet", "warn"
    SHUTTING_DOWN = 23, "the node ends", "ok"
    HANDOVER = 24, "the command moves at a bounded rate to that of the law", "ok"
    COMMAND_NOT_FINITE = 30, "the law's command is not finite", "error"
    COMMAND_LIMIT = 31, "the law's command is above its limit", "error"
    COMMAND_RATE = 32, "the law's command changes faster than allowed", "error"
    LAW_UNDEFINED = 33, "the law has no value for its inputs", "error"
    CLOCK_BACKWARD = 40, "the clock was set back", "warn"
    CLOCK_AHEAD = 41, "the clock jumped ahead", "error"
    NOT_MOVING = 50, "the ship is driven and does not move", "error"
    SATURATED = 51, "the command has been at a limit for too long", "error"
    INNOVATION = 52, "measurements have contradicted the estimate for too long", "error"
    VELOCITY = 53, "the measured velocities do not fit the positions", "error"
    FENCE = 54, "the vessel could not stop inside of the fence", "error"
    HEADING = 56, "the measured heading does not fit the motion", "error"
    SECOND_PUBLISHER = 60, "another node publishes as well", "error"
    NO_CONSUMER = 61, "nothing subscribes to cmd_wrench", "error"


ACTIONS = ("zero", "ramp", "hold", "brake", "fallback")


@dataclass(frozen=True)
class FreshnessParameters:
    """Which samples of an input count, beside those that are older than its time-out."""

    future_tolerance: float = parameter(
        0.1, "Time by which a stamp may be ahead of the node's clock.", unit="s", low=0.0, high=60.0
    )
    frames_checked: bool = parameter(True, "Refuse messages whose frames are not those of the node, frame_prefix included.")
    covariance_limit: float = parameter(
        math.inf, "Largest variance of x and y, in the covariance of the pose; inf: no bound.", unit="m²", low=0.0, high=math.inf
    )


def own_rate(what: str, unit: str) -> float:
    """Declare the largest rate of change of a law's own commands, without a bound by default."""
    return parameter(
        math.inf,
        f"Largest rate of change of the law's {what}; a faster one is a violation, with the safe action; inf: no bound.",
        unit=unit,
        low=1e-6,
        high=math.inf,
    )


def bound(what: str, unit: str) -> float:
    """Declare the bound of the guard, by default that of the vessel."""
    return parameter(
        -1.0,
        f"Largest {what} that leaves the node; -1: that of controller.vessel for a law that keeps to it, else none; inf: none.",
        unit=unit,
        low=-1.0,
        high=math.inf,
    )


def delay(description: str, default: float) -> float:
    """Declare the time after which a monitor acts; infinite: never."""
    return parameter(default, description, unit="s", low=0.1, high=math.inf)


@dataclass(frozen=True)
class MonitorParameters:
    """When the monitors warn, and when the safe action begins."""

    driven_share: float = parameter(
        0.9, "Share of its limit from which on a force or moment has to move the ship.", low=0.01, high=1.0
    )
    moving_speed: float = parameter(
        0.05, "Surge speed below which a driven ship counts as not moving.", unit="m/s", low=0.0, high=100.0
    )
    moving_yaw_rate: float = parameter(
        0.002, "Yaw rate below which a driven ship counts as not turning.", unit="rad/s", low=0.0, high=10.0
    )
    not_moving_warning: float = delay("Time for which the ship is driven and does not move before a warning.", 10.0)
    not_moving_safe: float = delay("The same before the safe action; inf: never.", 30.0)
    saturation_warning: float = delay("Time at one and the same limit before a warning.", 300.0)
    saturation_safe: float = delay("The same before the safe action; inf: never.", math.inf)
    innovation_warning: float = delay(
        "Time for which the observer rejects measurements that contradict its estimate before a warning.", 2.0
    )
    innovation_safe: float = delay("The same before the safe action; inf: never.", 10.0)
    velocity_warning: float = delay(
        "Time for which the measured velocities of a moving ship contradict its positions before a warning, without an observer.",
        1.0,
    )
    velocity_safe: float = delay("The same before the safe action; inf: never.", 4.0)
    heading_warning: float = delay(
        "Time for which the heading contradicts the courses of a ship, by more than noise and current, before a warning.", 5.0
    )
    heading_safe: float = delay("The same before the safe action; inf: never.", 15.0)


@dataclass(frozen=True)
class FenceGuardParameters(FenceParameters):
    """The fence, and what the controller does before the vessel would cross it."""

    action: str = parameter(
        "hold",
        "What follows once the vessel could not stop inside any more and has braked: hold, keep station where it came from;"
        " return, go back along the way that it came; brake, nothing but braking, so that it drifts.",
        choices=("hold", "return", "brake"),
    )
    margin: float = parameter(
        -1.0, "Distance that the origin keeps from the fence; -1: half of vessel.length.", unit="m", low=-1.0, high=1e4
    )
    current: float = parameter(
        0.0,
        "Largest current, with the drift by wind, where the law does not observe it: only guided does.",
        unit="m/s",
        low=0.0,
        high=10.0,
    )


@dataclass(frozen=True)
class SafetyParameters:
    """What the controller checks, and what it commands when a check fails."""

    freshness: FreshnessParameters = group(FreshnessParameters)
    monitors: MonitorParameters = group(MonitorParameters)
    fence: FenceGuardParameters = group(FenceGuardParameters)
    action: str = parameter(
        "ramp",
        "Safe action: zero at once, ramp to zero, hold and then ramp, brake against the measured motion, or the wrench of"
        " fallback_law while its inputs are good.",
        choices=ACTIONS,
    )
    hold_time: float = parameter(2.0, "With hold, the time before the ramp.", unit="s", low=0.0, high=600.0)
    ramp_time: float = parameter(
        5.0,
        "Time from the limits of controller.vessel to zero: the rate of every change of command that is not the law's own.",
        unit="s",
        low=0.1,
        high=600.0,
    )
    fallback_law: str = parameter("los_pid", "With fallback, the law that steers while the chosen one has no valid command.")
    fresh_samples: int = parameter(3, "Good control periods before the law commands again.", low=1, high=10_000)
    dead_reckoning: float = parameter(
        0.0,
        "Longest time without a position, NaN in a measurement that has a heading, for which the last place moves on by the"
        " measured velocities, with an observer by the estimated ones; 0: never.",
        unit="s",
        low=0.0,
        high=60.0,
    )
    jump_samples: int = parameter(
        5, "Samples after a jump that must agree with each other to be taken as a re-localisation.", low=1, high=10_000
    )
    jump_speed: float = parameter(
        -1.0,
        "Speed that no ship of this kind has; -1: three times sqrt(g·length), a Froude number of 3; inf: no check.",
        unit="m/s",
        low=-1.0,
        high=math.inf,
    )
    enable_distance: float = parameter(
        -1.0,
        "Largest distance of the reference at which ~/enable is accepted and the law commands, in real time; -1: 100 lengths of"
        " the vessel; inf: any.",
        unit="m",
        low=-1.0,
        high=math.inf,
    )
    surge_force_limit: float = bound("surge force", "N")
    yaw_moment_limit: float = bound("yaw moment", "N·m")
    surge_force_rate: float = own_rate("surge force", "N/s")
    yaw_moment_rate: float = own_rate("yaw moment", "N·m/s")


def check_safety(p: SafetyParameters, law: str, laws: Collection[str], limits: tuple[float, float]) -> None:
    """Check what single declarations cannot: a fallback to another law, alarms in their order, rates that allow the ramp.

    `limits`: largest surge force and yaw moment of the vessel, N and N·m. Raises ParameterError if they contradict each other.
    """
    if p.action == "fallback":
        others = ", ".join(name for name in laws if name != law)
        if p.fallback_law == law or p.fallback_law not in laws:
            raise ParameterError(f"controller.safety.fallback_law must be one of {others} with law {law} (got {p.fallback_law})")
    for name in ("not_moving", "saturation", "innovation", "velocity", "heading"):
        warning, safe = getattr(p.monitors, f"{name}_warning"), getattr(p.monitors, f"{name}_safe")
        if warning > safe:
            raise ParameterError(
                f"controller.safety.monitors.{name}_warning must be at most {name}_safe = {safe:g} s (got {warning:g} s)"
            )
    for name, limit in zip(("surge_force", "yaw_moment"), limits, strict=True):
        rate, ramp = getattr(p, f"{name}_rate"), limit / p.ramp_time
        if rate < ramp:
            raise ParameterError(
                f"controller.safety.{name}_rate must be at least {ramp:g}, at which the command moves in ramp_time ="
                f" {p.ramp_time:g} s from vessel.{name}_limit to zero (got {rate:g})"
            )
