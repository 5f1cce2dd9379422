"""The topics that a connection with a boat needs, by the parameters of its nodes."""

import math
from collections.abc import Mapping
from typing import Any

from vessel_hsmc_ros.boats.interfaces import Interface
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.messages.conversions import BODY
from vessel_hsmc_ros.preflight.connection import EULER, Connection, Role
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS

Values = Mapping[str, Mapping[str, Any]]  # parameters by their dotted names, by node
Names = Mapping[str, Mapping[str, str]]  # full names of topics by the names that the nodes give them, by node
STATES = {
    "odometry": {"odometry": ("odom", types.ODOMETRY)},
    "pose_twist": {"pose": ("pose", types.POSE), "twist": ("twist", types.TWIST_STAMPED)},
    "pose_covariance_twist": {"pose": ("pose", types.POSE_COVARIANCE), "twist": ("twist", types.TWIST_STAMPED)},
}

HEADINGS = {
    "imu": {"imu": ("imu", types.IMU)},
    "imu_euler": {EULER: ("imu", types.IMU)},
    "quaternion": {"heading": ("heading", types.QUATERNION)},
    "antennas": {"fix_2": ("fix_2", types.FIX)},
}

OVER_GROUND = {
    "none": {},
    "twist": {"fix_velocity": ("fix_velocity", types.TWIST_STAMPED)},
    "course": {"course": ("course", types.NUMBER), "speed": ("speed", types.NUMBER)},
}

OUTPUTS = {
    "normalised": {"output": ("normalised_wrench", types.WRENCH)},
    "cmd_vel": {"output": ("cmd_vel", types.TWIST_STAMPED)},
    "helm": {"throttle": ("throttle", types.NUMBER), "steering": ("steering", types.NUMBER)},
}


UNKNOWN = {"vessel.length": 1.0, "vessel.surge_inertia": math.nan, "vessel.yaw_inertia": math.nan}
"""What stands for the ship where no controller has been read; with a short one, slow motions count too."""


def values_of(stack: Interface | None, read: Values) -> dict[str, dict[str, Any]]:
    """The parameters of the nodes of a connection: as read from them, else those of the stack, else the defaults."""
    given: Values = stack.parameters if stack else {}
    nodes = dict.fromkeys(("controller", *(stack.nodes if stack else ()), *read))
    found: dict[str, dict[str, Any]] = {}
    for node in (n for n in nodes if n in NODES or n in WATCHERS):
        defaults = {name: entry.default for name, entry in schema.entries((NODES | WATCHERS)[node]).items()}
        found[node] = {**defaults, **{k: v for k, v in given.get(node, {}).items() if k in defaults}, **read.get(node, {})}
    if "controller" not in read:
        found["controller"] |= UNKNOWN
    return found


def connection_of(values: Values, names: Names, **observed: Any) -> Connection:
    """The connection that nodes with some parameters need."""
    p = values["controller"]
    roles = [*_state(p, names), *_sensors(values, names)]
    commanded = _name(names, "controller", "cmd_wrench")
    body = str(values.get("drive", p)["frame_prefix"]) + BODY
    roles.append(Role("command", commanded, (types.WRENCH,), False, (body,), own="cmd_wrench"))
    if "drive" in values:
        d = values["drive"]
        twist = types.TWIST_STAMPED if d["stamped"] else types.TWIST
        pulses = {f"pwm {name}": (f"thrusters/{name}/pwm", types.PULSE) for name in d["pwm.thrusters"]}
        for name, (own, kind) in {**OUTPUTS, "pwm": pulses}[str(d["form"])].items():
            kinds = (twist,) if own == "cmd_vel" else (kind,)
            roles.append(Role(name, _name(names, "drive", own), kinds, False, own=own))
    return Connection(
        tuple(roles),
        twist_frame=str(p["odometry.twist_frame"]),
        length=float(p["vessel.length"]),
        noise=(float(p["observer.position_noise"]), float(p["observer.heading_noise"])) if p["observer.enabled"] else (0.0, 0.0),
        inertias=(float(p["vessel.surge_inertia"]), float(p["vessel.yaw_inertia"])),
        future=float(p["safety.freshness.future_tolerance"]),
        covariance_limit=float(p["safety.freshness.covariance_limit"]),
        uses_observer=bool(p["observer.enabled"]),
        **observed,
    )


def _state(p: Mapping[str, Any], names: Names) -> list[Role]:
    """The measured motion, as the controller takes it, and the reference."""
    checked = p["safety.freshness.frames_checked"]
    prefix, timeout = str(p["frame_prefix"]), float(p["input_timeout"])
    frames, bodies = (tuple(prefix + f for f in p[f"odometry.{k}"]) if checked else () for k in ("frames", "body_frames"))
    parts = STATES[str(p["odometry.form"])].items()
    found = [
        Role(
            name,
            _name(names, "controller", own),
            (kind,),
            True,
            frames if name != "twist" else (),
            bodies if name == "odometry" else (),
            timeout,
            own,
        )
        for name, (own, kind) in parts
    ]
    return [
        *found,
        Role("reference", _name(names, "controller", "reference"), (types.REFERENCE,), True, (), (), timeout, "reference"),
    ]


def _sensors(values: Values, names: Names) -> list[Role]:
    """What navsat_odom takes."""
    if "navsat_odom" not in values:
        return []
    p = values["navsat_odom"]
    parts = {"fix": ("fix", types.FIX)} | HEADINGS[str(p["heading"])] | OVER_GROUND[str(p["velocity"])]
    return [
        Role(name, _name(names, "navsat_odom", own), (kind,), True, (), (), float(p["timeout"]) + 1.0, own)
        for name, (own, kind) in parts.items()
    ]


def _name(names: Names, node: str, own: str) -> str:
    found = names.get(node, {}).get(own, own)
    return found if found.startswith("/") else f"/{found}"
