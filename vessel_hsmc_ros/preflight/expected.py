"""The topics that a connection with a boat needs, by the parameters of its nodes, and what a bag has of them."""

import math
from collections.abc import Mapping
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
from vessel_hsmc_ros.messages.state_columns import KNOWN, columns_of
from vessel_hsmc_ros.preflight.clocks import clocks_differ
from vessel_hsmc_ros.preflight.connection import EULER, WRONG, Connection, Endpoint, Role, Topic
from vessel_hsmc_ros.preflight.failsafe_rules import autopilot_of
from vessel_hsmc_ros.preflight.rules import judge
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS

Values = Mapping[str, Mapping[str, Any]]  # parameters by their dotted names, by node
Names = Mapping[str, Mapping[str, str]]  # full names of topics by the names that the nodes give them, by node
Topics = dict[str, tuple[str, str]]  # the name that a node gives a topic, and its type, by what it is

STATES: dict[str, Topics] = {
    "odometry": {"odometry": ("odom", types.ODOMETRY)},
    "pose_twist": {"pose": ("pose", types.POSE), "twist": ("twist", types.TWIST_STAMPED)},
    "pose_covariance_twist": {"pose": ("pose", types.POSE_COVARIANCE), "twist": ("twist", types.TWIST_STAMPED)},
}
HEADINGS: dict[str, Topics] = {
    "imu": {"imu": ("imu", types.IMU)},
    "imu_euler": {EULER: ("imu", types.IMU)},
    "quaternion": {"heading": ("heading", types.QUATERNION)},
    "quaternion_ned": {"heading": ("heading", types.QUATERNION)},
    "antennas": {"fix_2": ("fix_2", types.FIX)},
}
OVER_GROUND: dict[str, Topics] = {
    "none": {},
    "twist": {"fix_velocity": ("fix_velocity", types.TWIST_STAMPED)},
    "course": {"course": ("course", types.NUMBER), "speed": ("speed", types.NUMBER)},
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

    def roles(node: str, topics: Topics, is_input: bool, timeout: float = 0.5) -> list[Role]:
        found = [(name, names.get(node, {}).get(own, own), kind, own) for name, (own, kind) in topics.items()]
        return [Role(name, f"/{full.lstrip('/')}", (kind,), is_input, (), (), timeout, own) for name, full, kind, own in found]

    p = values["controller"]
    needed = with_frames(p, roles("controller", STATES[str(p["odometry.form"])], True, float(p["input_timeout"])))
    needed += roles("controller", {"reference": ("reference", types.REFERENCE)}, True, float(p["input_timeout"]))
    if sensors := values.get("navsat_odom"):
        taken = {"fix": ("fix", types.FIX)} | HEADINGS[str(sensors["heading"])] | OVER_GROUND[str(sensors["velocity"])]
        needed += roles("navsat_odom", taken, True, float(sensors["timeout"]) + 1.0)
    body = str(values.get("drive", p)["frame_prefix"]) + BODY
    needed += [r._replace(frames=(body,)) for r in roles("controller", {"command": ("cmd_wrench", types.WRENCH)}, False)]
    if drive := values.get("drive"):
        needed += roles("drive", outputs(drive), False)
    return Connection(
        tuple(needed),
        twist_frame=str(p["odometry.twist_frame"]),
        length=float(p["vessel.length"]),
        noise=(float(p["observer.position_noise"]), float(p["observer.heading_noise"])) if p["observer.enabled"] else (0.0, 0.0),
        inertias=(float(p["vessel.surge_inertia"]), float(p["vessel.yaw_inertia"])),
        future=float(p["safety.freshness.future_tolerance"]),
        covariance_limit=float(p["safety.freshness.covariance_limit"]),
        uses_observer=bool(p["observer.enabled"]),
        **observed,
    )


def with_frames(p: Mapping[str, Any], roles: list[Role]) -> list[Role]:
    """The topics of the measured motion with the frames that the controller accepts."""
    if not p["safety.freshness.frames_checked"]:
        return roles
    frames, bodies = (tuple(p["frame_prefix"] + name for name in p[f"odometry.{key}"]) for key in ("frames", "body_frames"))
    accepted = {"odometry": (frames, bodies), "pose": (frames, ()), "twist": ((), ())}
    return [role._replace(frames=accepted[role.name][0], child_frames=accepted[role.name][1]) for role in roles]


def outputs(drive: Mapping[str, Any]) -> Topics:
    """What a drive publishes, by its form."""
    forms: dict[str, Topics] = {
        "normalised": {"output": ("normalised_wrench", types.WRENCH)},
        "cmd_vel": {"output": ("cmd_vel", types.TWIST_STAMPED if drive["stamped"] else types.TWIST)},
        "helm": {"throttle": ("throttle", types.NUMBER), "steering": ("steering", types.NUMBER)},
        "pwm": {f"pwm {name}": (f"thrusters/{name}/pwm", types.PULSE) for name in drive["pwm.thrusters"]},
    }
    return forms[str(drive["form"])]


def exercised(topics: Mapping[str, Topic]) -> dict[str, tuple[str, ...]]:
    """The kinds of the events of the nodes, and the reasons for which the controller has left the law."""
    kinds, reasons = (
        list(dict.fromkeys(value for topic in topics.values() for value in topic.columns.get(name, ())))
        for name in ("kind", "reason")
    )
    return {"events": tuple(kinds), "reasons": tuple(reason.name for reason in Reason if int(reason) in reasons)}


def recorded_name(bag: Bag, role: Role) -> str:
    """The name of a topic in a bag: that of the stack, else the recorded one, else the only one of the type."""
    if role.topic in bag.topics:
        return role.topic
    own = bag.find("/", "odom") if role.name == "odometry" else None
    if own is not None:
        return own.name
    typed = [name for name, series in bag.topics.items() if series.type in role.kinds and not series.undecodable]
    found = [name for name in typed if name.endswith(role.topic)] or (typed if role.is_input else [])
    return found[0] if len(found) == 1 else role.topic


def connection_in(bag: Bag, stack: Interface | None = None) -> Connection:
    """The connection that a bag shows. Raises BagError if a topic cannot be read."""
    recorded = {name.rpartition("/")[2]: values for name, values in bag.parameters.items()}
    made = connection_of(values_of(stack, recorded), stack.nodes if stack else {}, is_live=False)
    roles = [role._replace(topic=recorded_name(bag, role)) for role in made.roles]
    # A bag need not have what this package computes, nor what it converts.
    roles = [r for r in roles if r.topic in bag.topics or (r.is_input and r.name != "reference")]
    applied = [name for name in bag.topics if name.endswith("/applied_wrench")]
    roles += [Role("applied", name, (bag.topics[name].type,), False) for name in applied[:1] if bag.readable(name)]
    wanted = {role.topic for role in roles}
    topics = {name: _topic(series, name in wanted or series.type in TOLD) for name, series in bag.topics.items()}
    autopilot = autopilot_of(stack.name if stack else "", {})
    return made._replace(roles=tuple(roles), topics=topics, autopilot=autopilot, **exercised(topics))  # type: ignore[arg-type] # by name


TOLD = (types.EVENT, types.CONTROL_STATE)  # the types by which the nodes tell what they do
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
