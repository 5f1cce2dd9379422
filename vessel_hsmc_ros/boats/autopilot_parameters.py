"""Parameters of the nodes that connect a boat by its autopilot, which speaks MAVLink or is PX4, in real time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vessel_hsmc_ros.boats.mavlink_messages import OVERRIDDEN, SURFACE_MODES
from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import NamedVessel
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import FIXED, ThrusterLayout
from vessel_hsmc_ros.scenario.parameter_groups import CommonParameters, command_timeout, ramp_time, transform

MODES = {"manual": "MANUAL", "channels": "MANUAL", "guided": "GUIDED"}
"""The forms of command, and the mode of ArduPilot's surface vehicles in which each is carried out."""

BY_FORM = "by_form"


@dataclass(frozen=True)
class DrivenThrusters(NamedVessel):
    """The thrusters that the autopilot passes pulses on to."""

    thrusters: ThrusterLayout = group(ThrusterLayout)


def widths(default: tuple[float, ...], what: str) -> tuple[float, ...]:
    """Declare pulse widths."""
    return parameter(default, what, unit="µs", low=500.0, high=2500.0, length=len(default))


def numbers(default: tuple[float, ...], what: str, high: float) -> tuple[float, ...]:
    """Declare numbers of channels or outputs, from 1 on."""
    return parameter(default, what, low=1.0, high=high)


@dataclass(frozen=True)
class MavlinkParameters(CommonParameters):
    """Parameters of mavlink, which connects the nodes with an autopilot that speaks MAVLink, in real time."""

    connection: str = parameter(
        "udpin:0.0.0.0:14550", "Address as pymavlink has it: udpin:HOST:PORT, udpout:..., tcp:..., or a serial port."
    )
    publish_tf: bool = transform()
    baud: int = parameter(115200, "Rate of a serial port.", low=1200, high=4_000_000)
    system_id: int = parameter(
        255, "Own system: that of the ground station, of which alone ArduPilot takes overrides (MAV_GCS_SYSID).", low=1, high=255
    )
    target_system: int = parameter(0, "System of the autopilot; 0: the first one that is heard.", low=0, high=255)
    form: str = parameter(
        "manual",
        "manual: cmd_wrench as MANUAL_CONTROL, throttle and steering; channels: the thrust of each thruster as"
        " RC_CHANNELS_OVERRIDE; guided: cmd_vel as SET_ATTITUDE_TARGET, speed and yaw rate.",
        choices=tuple(MODES),
    )
    mode: str = parameter(
        BY_FORM,
        "Mode in which commands are passed on; by_form: MANUAL, or GUIDED with guided.",
        choices=(BY_FORM, *SURFACE_MODES),
    )
    surge_force_limit: float = parameter(1.0, "With manual, the force at full throttle.", unit="N", low=1e-6, high=1e15)
    yaw_moment_limit: float = parameter(1.0, "With manual, the moment at full steering.", unit="N·m", low=1e-6, high=1e15)
    cruise_speed: float = parameter(
        2.0, "With guided, CRUISE_SPEED of the autopilot, the speed at a thrust of 1.", unit="m/s", low=0.01, high=100.0
    )
    channels: tuple[float, ...] = numbers(
        (1.0, 3.0), "With channels, the channel of the radio that the autopilot passes on to each thruster.", OVERRIDDEN
    )
    servos: tuple[float, ...] = numbers(
        (1.0, 3.0),
        "Outputs of SERVO_OUTPUT_RAW for applied_wrench: those of vessel.thrusters or, without, left and right of skid steering.",
        16.0,
    )
    pulses: tuple[float, ...] = widths(
        (1100.0, 1500.0, 1900.0), "Pulse widths of full thrust astern, none and full thrust ahead."
    )
    radio_range: tuple[float, ...] = widths((1100.0, 1900.0), "RCn_MIN and RCn_MAX of the stick channels.")
    stick_channels: tuple[float, ...] = parameter(
        (1.0, 3.0), "Channels of the radio for steering and throttle.", low=1.0, high=OVERRIDDEN, length=2
    )
    stick_threshold: float = parameter(100.0, "Movement of a stick that takes over.", unit="µs", low=10.0, high=1000.0)
    heartbeat_timeout: float = parameter(
        3.0, "Time without a heartbeat of the autopilot after which it counts as lost.", unit="s", low=0.5, high=60.0
    )
    state_timeout: float = parameter(
        0.5, "Age, beside a position, from which on an attitude does not count.", unit="s", low=0.01, high=60.0
    )
    stream_rate: float = parameter(
        30.0, "Rate requested for position, attitude and outputs; 0: request nothing.", unit="Hz", low=0.0, high=200.0
    )
    command_timeout: float = command_timeout()
    ramp_time: float = ramp_time()
    rate_hz: float = parameter(25.0, "Rate of the output.", unit="Hz", low=2.0, high=200.0)
    freshness: FreshnessParameters = group(FreshnessParameters)
    vessel: DrivenThrusters = group(DrivenThrusters)

    def __post_init__(self) -> None:
        """Check the lists against each other.

        Raises ParameterError if pulse widths do not increase, thrusters and channels do not fit each other, or of the numbers
        of channels or outputs one is given twice or not whole.
        """
        for name in ("pulses", "radio_range"):
            values = getattr(self, name)
            if list(values) != sorted(set(values)):
                raise ParameterError(f"mavlink.{name} must be increasing widths (got {list(values)})")
        for name in ("channels", "servos", "stick_channels"):
            values = getattr(self, name)
            if len(set(values)) < len(values) or any(value != int(value) for value in values):
                raise ParameterError(f"mavlink.{name} must be different whole numbers (got {list(values)})")
        layout = self.vessel.thrusters
        if self.form == "channels" and not layout:
            raise ParameterError("mavlink.form = channels needs vessel.thrusters: name the thrusters")
        turning = any(t.kind != FIXED for t in layout.thrusters())
        if turning and self.form == "channels":
            raise ParameterError("mavlink.form must be manual or guided with thrusters that turn (got channels)")
        if turning and self.servos:
            raise ParameterError(f"mavlink.servos must be [] with thrusters that turn (got {list(self.servos)})")
        count = len(layout.thrusters()) or 2
        if self.form == "channels" and len(self.channels) != count:
            raise ParameterError(f"mavlink.channels must be {count} numbers, one for each thruster (got {list(self.channels)})")
        if len(self.servos) not in (0, count):
            raise ParameterError(f"mavlink.servos must be {count} numbers, or none (got {list(self.servos)})")

    @property
    def mode_number(self) -> int:
        """The number of the mode in which commands are passed on."""
        return SURFACE_MODES[MODES[self.form] if self.mode == BY_FORM else self.mode]

    def applied_wrench(self, shares: Sequence[float]) -> tuple[float, float]:
        """The surge force, N, and the yaw moment, N·m, of the thrusters with some shares of their thrust."""
        thrusters = self.vessel.thrusters.thrusters()
        if not thrusters:
            left, right = shares
            return 0.5 * (left + right) * self.surge_force_limit, 0.5 * (right - left) * self.yaw_moment_limit
        forces = [
            share * (t.thrust_ahead if share > 0.0 else t.thrust_astern) for t, share in zip(thrusters, shares, strict=True)
        ]
        surge = sum(force * math.cos(t.angle) for t, force in zip(thrusters, forces, strict=True))
        yaw = sum(force * (t.x * math.sin(t.angle) - t.y * math.cos(t.angle)) for t, force in zip(thrusters, forces, strict=True))
        return surge, yaw


@dataclass(frozen=True)
class Px4Parameters(CommonParameters):
    """Parameters of px4, which connects the nodes with PX4 over its DDS bridge, in real time."""

    publish_tf: bool = transform()
    surge_force_limit: float = parameter(1.0, "The force at full throttle.", unit="N", low=1e-6, high=1e15)
    yaw_moment_limit: float = parameter(1.0, "The moment at full steering.", unit="N·m", low=1e-6, high=1e15)
    heartbeat_timeout: float = parameter(
        3.0, "Time without a VehicleStatus after which the autopilot counts as lost.", unit="s", low=0.5, high=60.0
    )
    command_timeout: float = command_timeout()
    ramp_time: float = ramp_time()
    rate_hz: float = parameter(25.0, "Rate of the setpoints; PX4 needs more than 2 Hz.", unit="Hz", low=5.0, high=200.0)
    freshness: FreshnessParameters = group(FreshnessParameters)
