"""Parameters of the nodes that connect a boat in real time, and the interfaces of stacks: the parameters and topics for each.

Interfaces stand in `config/interfaces/stacks.yaml`, of which `vessel-hsmc init` makes a parameters file, and `make docs`
docs/boats.md.
"""

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import yaml

from vessel_hsmc_ros.boats.autopilot import OVERRIDDEN, SURFACE_MODES, skid_steering, thrusts, wrench_of
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import NamedVessel
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.kernel import clip
from vessel_hsmc_ros.core.node_list import PROGRAMS
from vessel_hsmc_ros.core.schema import group, parameter, suggestion
from vessel_hsmc_ros.core.thruster_layout import FIXED, HIGHEST, LOWEST, ThrustCurve, ThrusterLayout, thrust_curve
from vessel_hsmc_ros.scenario.parameter_groups import CommonParameters, transform
from vessel_hsmc_ros.scenario.parameters_file import tree, yaml_text


@dataclass(frozen=True)
class PulseParameters:
    """Thrusters, deadband and measured curve of the speed controllers."""

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


HEADINGS = ("imu", "imu_euler", "quaternion", "quaternion_ned", "antennas")
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
        " quaternion. quaternion_ned: on heading, of a yaw clockwise from north, as nmea_navsat_driver publishes it.",
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


@dataclass(frozen=True)
class PassingParameters(CommonParameters):
    """Parameters of every node that passes commands on."""

    command_timeout: float = parameter(
        0.5, "Age of a command after which the output ramps to zero.", unit="s", low=0.01, high=60.0, tunable=True
    )
    ramp_time: float = parameter(
        2.0,
        "Time in which the output goes from its limit to zero, and back; 0: at once.",
        unit="s",
        low=0.0,
        high=600.0,
        tunable=True,
    )
    freshness: FreshnessParameters = group(FreshnessParameters)


def full(what: str, unit: str) -> float:
    """Declare the force or moment that is 1 in the normalised forms."""
    return parameter(1.0, f"{what}: what 1 means in the normalised forms.", unit=unit, low=1e-6, high=1e15)


@dataclass(frozen=True)
class NormalisedParameters(PassingParameters):
    """Parameters of every node that can pass commands on as shares of the largest force and moment."""

    surge_force_limit: float = full("Largest surge force of the vessel, at full throttle", "N")
    yaw_moment_limit: float = full("Largest yaw moment of the vessel, at full steering", "N·m")

    def shares(self, wrench: Sequence[float]) -> tuple[float, float]:
        """The shares of a surge force, N, and a yaw moment, N·m, within -1 and 1."""
        return clip(wrench[0] / self.surge_force_limit, 1.0), clip(wrench[1] / self.yaw_moment_limit, 1.0)


@dataclass(frozen=True)
class DriveParameters(NormalisedParameters):
    """Parameters of drive, which gives the commands of the controller the form that a stack takes, in real time."""

    form: str = parameter(
        "normalised",
        "normalised: WrenchStamped with force.x and torque.z of at most 1; cmd_vel: surge speed and yaw rate; helm: throttle and"
        " steering of at most 1, Float64; pwm: a pulse width for each thruster, UInt16 in µs, from the thrusts of"
        " thruster_allocation.",
        choices=FORMS,
    )
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
    rate_hz: float = parameter(20.0, "Rate of the output.", unit="Hz", low=1.0, high=1000.0)
    pwm: PulseParameters = group(PulseParameters)

    def __post_init__(self) -> None:
        """Check the sign. Raises ParameterError if it is neither 1 nor -1."""
        if abs(self.steering_sign) != 1.0:
            raise ParameterError(f"drive.steering_sign must be 1 or -1 (got {self.steering_sign:g})")


def passed_on(what: str, unit: str) -> float:
    """Declare the largest force or moment that the watchdog passes on."""
    return parameter(math.inf, f"Largest {what} that is passed on; inf: no limit.", unit=unit, low=0.0, high=math.inf)


@dataclass(frozen=True)
class WatchdogParameters(PassingParameters):
    """Parameters of watchdog, which passes commands on in real time while they are fresh."""

    rate_hz: float = parameter(50.0, "Rate of the wrench on its way to zero and at zero.", unit="Hz", low=1.0, high=1000.0)
    surge_force_limit: float = passed_on("surge force", "N")
    yaw_moment_limit: float = passed_on("yaw moment", "N·m")
    watched_nodes: tuple[str, ...] = parameter(
        ("controller",), "Nodes in the namespace of the watchdog whose diagnostics must not cease; [''] for none."
    )
    heartbeat_timeout: float = parameter(
        3.0, "Longest time between two diagnostics of a watched node.", unit="s", low=0.1, high=600.0
    )


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
class MavlinkParameters(NormalisedParameters):
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
    rate_hz: float = parameter(25.0, "Rate of the output.", unit="Hz", low=2.0, high=200.0)
    vessel: DrivenThrusters = group(DrivenThrusters)

    def __post_init__(self) -> None:
        """Check the lists against each other."""
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
            return skid_steering(shares, (self.surge_force_limit, self.yaw_moment_limit))
        surge, _, yaw = wrench_of(thrusters, thrusts(shares, thrusters), [t.angle for t in thrusters])
        return surge, yaw


@dataclass(frozen=True)
class Px4Parameters(NormalisedParameters):
    """Parameters of px4, which connects the nodes with PX4 over its DDS bridge, in real time."""

    publish_tf: bool = transform()
    heartbeat_timeout: float = parameter(
        3.0, "Time without a VehicleStatus after which the autopilot counts as lost.", unit="s", low=0.5, high=60.0
    )
    rate_hz: float = parameter(25.0, "Rate of the setpoints; PX4 needs more than 2 Hz.", unit="Hz", low=5.0, high=200.0)


class Interface(NamedTuple):
    """The interface of a stack."""

    name: str  # as `init` takes it
    title: str
    # state, command: its messages, in words
    state: str
    command: str
    nodes: Mapping[str, Mapping[str, str]]  # the topics of each node under the names of the stack
    # values of each node by their dotted names, where they differ from the defaults
    parameters: Mapping[str, Mapping[str, Any]]
    # before, stop: what a person does before the first start, and to stop the boat
    before: tuple[str, ...]
    stop: tuple[str, ...]


@cache
def interfaces() -> dict[str, Interface]:
    """All interfaces by their names."""
    text = (share_directory() / "config" / "interfaces" / "stacks.yaml").read_text(encoding="utf-8")
    return {
        name: Interface(name, **{**entry, "before": tuple(entry["before"]), "stop": tuple(entry["stop"])})
        for name, entry in yaml.safe_load(text).items()
    }


def interface(name: str) -> Interface:
    """The interface of a name. Raises ParameterError if there is none."""
    known = interfaces()
    if name not in known:
        raise ParameterError(f"--interface {name} is not known: {suggestion(name, known)}")
    return known[name]


def parameters_of(stack: Interface, vessel: KnownVessel) -> dict[str, dict[str, Any]]:
    """The values of each node by their dotted names, with those of the vessel for names in braces."""

    def filled(value: Any) -> Any:
        return getattr(vessel, value.strip("{}")) if isinstance(value, str) and value.startswith("{") else value

    return {node: {name: filled(value) for name, value in values.items()} for node, values in stack.parameters.items()}


def interface_text(stack: Interface, name: str, vessel: KnownVessel, noise_known: bool = False) -> str:
    """Write the parameters file of an interface, which is given to each node after that of the ship.

    `name`: of the ship: the file is `<name>_<interface>.yaml`. `noise_known`: whether the file of the ship has the noise of its
    positions, which that of the stack then leaves as it is.
    """
    parameters = parameters_of(stack, vessel)
    if noise_known:
        parameters.get("controller", {}).pop("observer.position_noise", None)
    sections = {f"/**/{node}": {"ros__parameters": tree(values)} for node, values in parameters.items()}
    head = [f"{stack.title}. Written by `vessel-hsmc init`; edit it at will. Start each node in a terminal of its own:", ""]
    lines = [
        *head,
        *commands(stack, name),
        "",
        "then `vessel-hsmc call enable`. docs/boats.md has the steps before, and the stop.",
    ]
    comment = "\n".join(f"# {line}".rstrip() for line in lines)
    return f"{comment}\n\n{yaml_text(sections, default_flow_style=None, width=130)}"


def commands(stack: Interface, name: str) -> list[str]:
    """The commands that start the nodes of an interface, for a ship of a name."""
    names: dict[str, Mapping[str, str]] = {}
    for node, topics in stack.nodes.items():  # in the order of their start, with the reference before the controller
        names |= {"reference_ship": {}, node: topics} if node == "controller" else {node: topics}
    files = " ".join(f"--params-file {shlex.quote(file)}" for file in (f"{name}.yaml", f"{name}_{stack.name}.yaml"))
    remaps = {node: "".join(f" -r {own}:={other}" for own, other in topics.items()) for node, topics in names.items()}
    return [f"{PROGRAMS[node].executable} --ros-args {files}{remaps[node]}" for node in names]
