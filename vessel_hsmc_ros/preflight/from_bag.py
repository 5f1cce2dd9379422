"""A connection with a boat as a bag has it, for the rules of `vessel-hsmc check`."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vessel_hsmc_ros.bags.reader import Bag
from vessel_hsmc_ros.bags.topic_columns import Series
from vessel_hsmc_ros.boats.interfaces import Interface
from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages.state_columns import CONTROL_STATE, KNOWN, columns_of
from vessel_hsmc_ros.messages.topics import EVENTS
from vessel_hsmc_ros.preflight.connection import WRONG, Connection, Endpoint, Role, Topic
from vessel_hsmc_ros.preflight.expected import connection_of, values_of
from vessel_hsmc_ros.preflight.failsafe_rules import autopilot_of
from vessel_hsmc_ros.preflight.rules import judge
from vessel_hsmc_ros.preflight.stamp_rules import clocks_differ


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
