"""Parameters of the nodes that connect a boat by its stack, in real time."""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import HIGHEST, LOWEST, ThrustCurve, thrust_curve
from vessel_hsmc_ros.scenario.parameter_groups import CommonParameters, command_timeout, ramp_time, transform


@dataclass(frozen=True)
class PulseParameters:
    """Thrusters, deadband and measured curve of the speed controllers.

    Raises:
        ParameterError: the curve is none, a sign is missing, or a thruster is named twice.
    """

    thrusters: tuple[str, ...] = parameter(
        ("port", "starboard"), "Names of the thrusters, whose thrusts thruster_allocation commands."
    )
    neutral: float = parameter(1500.0, "Pulse width of rest, which is commanded at zero.", unit="µs", low=LOWEST, high=HIGHEST)
    deadband: float = parameter(
        25.0, "Distance from neutral up to which the thrust is zero; pulses jump across it.", unit="µs", low=0.0, high=300.0
    )
    curve_pulses: tuple[float, ...] = parameter(
        (1100.0, 1900.0), "Pulse widths at which the thrust was measured, increasing.", unit="µs", low=LOWEST, high=HIGHEST
    )
    curve_thrusts: tuple[float, ...] = parameter(
        (-40.0, 50.0), "The measured thrust of one thruster at each, increasing; beyond them the pulse is limited.", unit="N"
    )
    reversed: tuple[float, ...] = parameter(
        (1.0,),
        "For each thruster, or one for all, 1, or -1 where a longer pulse drives astern, as with a propeller of the other hand.",
        low=-1.0,
        high=1.0,
    )

    def __post_init__(self) -> None:
        self.curve()
        if len(set(self.thrusters)) < len(self.thrusters):
            raise ParameterError(f"drive.pwm.thrusters must name each thruster once (got {list(self.thrusters)})")
        if len(self.reversed) not in (1, len(self.thrusters)) or any(abs(sign) != 1.0 for sign in self.reversed):
            raise ParameterError(
                f"drive.pwm.reversed must be one or {len(self.thrusters)} values of 1 or -1 (got {list(self.reversed)})"
            )

    def curve(self) -> ThrustCurve:
        """The measured curve."""
        return thrust_curve(self.neutral, self.deadband, self.curve_pulses, self.curve_thrusts, "drive.pwm")

    def signs(self) -> tuple[float, ...]:
        """The sign of each thruster."""
        return self.reversed * len(self.thrusters) if len(self.reversed) == 1 else self.reversed


HEADINGS = ("imu", "imu_euler", "quaternion", "antennas")
VELOCITIES = ("none", "twist", "course")


@dataclass(frozen=True)
class NavsatOdometryParameters(CommonParameters):
    """Parameters of navsat_odom, which makes odometry of satellite fixes and a heading."""

    publish_tf: bool = transform()
    datum: tuple[float, ...] = parameter(
        (),
        "Latitude and longitude of the origin of the odometry, degrees; by default those of the first fix that the next"
        " one agrees with. Fixes must be within 50 km.",
    )
    heading: str = parameter(
        "imu",
        "Source of the heading: orientation on imu, quaternion on heading, or the fixes of two antennas, fix and fix_2."
        " imu_euler: on imu too, from drivers that publish roll, pitch and yaw in degrees, clockwise from north, in place of the"
        " quaternion.",
        choices=HEADINGS,
    )
    heading_offset: float = parameter(
        0.0,
        "Added to the heading of the source, which counts from east and counter-clockwise; for two antennas, the angle of the"
        " line from the first to the second one from the bow, to port.",
        unit="rad",
        low=-6.3,
        high=6.3,
    )
    velocity: str = parameter(
        "none",
        "Velocity over ground: none (zero; the controller needs its observer), twist (on fix_velocity, east and north), or course"
        " (on course, clockwise from north in rad, and speed).",
        choices=VELOCITIES,
    )
    antenna: tuple[float, ...] = parameter(
        (0.0, 0.0),
        "Place of the antenna ahead and to port of the origin of the vessel.",
        unit="m",
        low=-1e3,
        high=1e3,
        length=2,
    )
    timeout: float = parameter(
        0.5, "Age, beside a fix, from which on a heading or a velocity does not count.", unit="s", low=0.01, high=60.0
    )
    frame: str = parameter("odom", "Frame of the odometry, without frame_prefix.")

    def __post_init__(self) -> None:
        """Check the datum, of which there are two numbers or none. Raises ParameterError if there is another number of them."""
        if len(self.datum) not in (0, 2) or not all(map(math.isfinite, self.datum)):
            raise ParameterError(f"navsat_odom.datum must be a latitude and a longitude, or empty (got {list(self.datum)})")


FORMS = ("normalised", "cmd_vel", "helm", "pwm")


def largest(what: str, unit: str) -> float:
    """Declare the force or moment that is 1 in the normalised forms."""
    return parameter(1.0, f"{what} of the vessel: what 1 means in the normalised forms.", unit=unit, low=1e-6, high=1e15)


@dataclass(frozen=True)
class DriveParameters(CommonParameters):
    """Parameters of drive, which gives the commands of the controller the form that a stack takes, in real time."""

    form: str = parameter(
        "normalised",
        "normalised: WrenchStamped with force.x and torque.z of at most 1; cmd_vel: surge speed and yaw rate; helm: throttle and"
        " steering of at most 1, Float64; pwm: a pulse width for each thruster, UInt16 in µs, from the thrusts of"
        " thruster_allocation.",
        choices=FORMS,
    )
    surge_force_limit: float = largest("Largest surge force", "N")
    yaw_moment_limit: float = largest("Largest yaw moment", "N·m")
    surge_speed_limit: float = parameter(2.0, "With cmd_vel, the largest surge speed.", unit="m/s", low=0.0, high=100.0)
    yaw_rate_limit: float = parameter(0.5, "With cmd_vel, the largest yaw rate.", unit="rad/s", low=0.0, high=10.0)
    response_time: float = parameter(
        0.0,
        "With cmd_vel, the time constant of the stack's loops, with which the commanded wrench is expressed by velocities; 0: the"
        " velocities that the guidance commands.",
        unit="s",
        low=0.0,
        high=60.0,
    )
    surge_inertia: float = parameter(1.0, "With a response_time, m11 of the vessel.", unit="kg", low=1e-3, high=1e12)
    yaw_inertia: float = parameter(1.0, "With a response_time, m33 of the vessel.", unit="kg·m²", low=1e-3, high=1e15)
    stamped: bool = parameter(True, "With cmd_vel, TwistStamped; false: Twist.")
    steering_sign: float = parameter(
        1.0,
        "With helm and normalised, 1 where a positive steering or moment turns to port, -1 where to starboard.",
        low=-1.0,
        high=1.0,
    )
    command_timeout: float = command_timeout()
    ramp_time: float = ramp_time()
    rate_hz: float = parameter(20.0, "Rate of the output.", unit="Hz", low=1.0, high=1000.0)
    pwm: PulseParameters = group(PulseParameters)
    freshness: FreshnessParameters = group(FreshnessParameters)

    def __post_init__(self) -> None:
        """Check the sign. Raises ParameterError if it is neither 1 nor -1."""
        if abs(self.steering_sign) != 1.0:
            raise ParameterError(f"drive.steering_sign must be 1 or -1 (got {self.steering_sign:g})")


def passed_on(what: str, unit: str) -> float:
    """Declare the largest force or moment that the watchdog passes on."""
    return parameter(math.inf, f"Largest {what} that is passed on; inf: no limit.", unit=unit, low=0.0, high=math.inf)


@dataclass(frozen=True)
class WatchdogParameters(CommonParameters):
    """Parameters of watchdog, which passes commands on in real time while they are fresh."""

    command_timeout: float = command_timeout()
    ramp_time: float = ramp_time()
    rate_hz: float = parameter(50.0, "Rate of the wrench on its way to zero and at zero.", unit="Hz", low=1.0, high=1000.0)
    surge_force_limit: float = passed_on("surge force", "N")
    yaw_moment_limit: float = passed_on("yaw moment", "N·m")
    watched_nodes: tuple[str, ...] = parameter(
        ("controller",), "Nodes in the namespace of the watchdog whose diagnostics must not cease; [''] for none."
    )
    heartbeat_timeout: float = parameter(
        3.0, "Longest time between two diagnostics of a watched node.", unit="s", low=0.1, high=600.0
    )
    freshness: FreshnessParameters = group(FreshnessParameters)
