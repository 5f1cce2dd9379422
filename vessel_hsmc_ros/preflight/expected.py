"""The topics that a connection with a boat needs, by the parameters of its nodes, and what a bag has of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.boats.parameters import Interface
from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import state_columns as types
from vessel_hsmc_ros.messages.conversions import BODY
from vessel_hsmc_ros.messages.state_columns import CONTROL_STATE, KNOWN, columns_of
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.preflight.clocks import clocks_differ
from vessel_hsmc_ros.preflight.connection import EULER, WRONG, Connection, Endpoint, Role, Topic
from vessel_hsmc_ros.preflight.failsafe_rules import autopilot_of
from vessel_hsmc_ros.preflight.rules import judge
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


@dataclass(frozen=True)
class _Names:
    """Names of topics in a bag: that of the stack, else the recorded one, else the only one of the type."""

    bag: Bag

    def of(self, role: Role) -> str:
        if role.topic in self.bag.topics:
            return role.topic
        own = self.bag.find("/", "odom") if role.name == "odometry" else None
        if own is not None:
            return own.name
        typed = [name for name, series in self.bag.topics.items() if series.type in role.kinds and not series.undecodable]
        ending = [name for name in typed if name.endswith(role.topic)]
        found = ending or (typed if role.is_input else [])
        return found[0] if len(found) == 1 else role.topic


def connection_in(bag: Bag, stack: Interface | None = None) -> Connection:
    """The connection that a bag shows. Raises BagError if a topic cannot be read."""
    recorded = {name.rpartition("/")[2]: values for name, values in bag.parameters.items()}
    made = connection_of(values_of(stack, recorded), stack.nodes if stack else {}, is_live=False)
    names = _Names(bag)
    roles = [role._replace(topic=names.of(role)) for role in made.roles]
    # A bag need not have what this package computes, nor what it converts.
    roles = [r for r in roles if r.topic in bag.topics or (r.is_input and r.name != "reference")]
    applied = [name for name in bag.topics if name.endswith("/applied_wrench")]
    roles += [Role("applied", name, (bag.topics[name].type,), False) for name in applied[:1] if bag.readable(name)]
    wanted = {role.topic for role in roles}
    topics = {name: _topic(series, name in wanted) for name, series in bag.topics.items()}
    autopilot = autopilot_of(stack.name if stack else "", {})
    return made._replace(roles=tuple(roles), topics=topics, events=_events(bag), reasons=_reasons(bag), autopilot=autopilot)


JUDGED = ("odometry", "pose", "twist", "positions", "velocities", "heading")  # what the motion of a bag rests on


def faults_in(bag: Bag) -> list[str]:
    """Sentences on stamps, frames and units of the recorded motion that cannot be right, and on clocks that differ."""
    connection = connection_in(bag)
    found = [f"{each.about}: {each.text}" for each in judge(connection) if each.level == WRONG and each.about in JUDGED]
    state, force = connection.of("odometry"), connection.of("applied", "command")
    if state is not None and force is not None and "stamp" in force.columns:
        found.append(clocks_differ(state, force, connection.roles[0].timeout))
    return [text for text in found if text]


def _topic(series: Series, with_columns: bool) -> Topic:
    offered = series.qos or [{}]
    reliable = all(profile.get("reliability") != "best_effort" for profile in offered)
    latched = all(profile.get("durability") == "transient_local" for profile in offered)
    kind = f"{series.type or 'a topic'} that {series.undecodable}" if series.undecodable else series.type
    publishers = (Endpoint("the recording", kind, reliable, latched),)
    if not with_columns or not series.count or series.undecodable:
        return Topic(series.name, publishers)
    columns: Any = columns_of(series.type, lambda name: series[name]) if series.type in KNOWN else {}
    return Topic(series.name, publishers, (), series.log_time.astype(np.float64) / NANOSECONDS, columns)


def _events(bag: Bag) -> tuple[str, ...]:
    found = [name for name in bag.topics if name.endswith(f"/{EVENTS}") and bag.readable(name)]
    return tuple(dict.fromkeys(message.kind for _, _, message in bag.messages(*found))) if found else ()


def _reasons(bag: Bag) -> tuple[str, ...]:
    states = [series for name, series in bag.topics.items() if series.type == CONTROL_STATE and bag.readable(name)]
    codes = {int(code) for series in states for code in np.unique(series["reason"])}
    return tuple(reason.name for reason in Reason if int(reason) in codes)
