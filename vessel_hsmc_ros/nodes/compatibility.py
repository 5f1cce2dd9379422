"""Quality of service towards other programs: what cannot be connected is named, and a user may override what a topic has."""

import copy
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import QoSPolicyKind, QoSProfile, qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.nodes import qos

if TYPE_CHECKING:
    from rclpy.node import Node

OVERRIDES = "qos_overrides."
"""Prefix of rclpy's parameters, such as `qos_overrides./odom.subscription.reliability: reliable`."""

POLICIES = {
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "history": ("keep_last", "keep_all"),
    "depth": (),
}
"""The policies that may be overridden, with their values; the depth is an integer."""


class Compatibility:
    """The quality of service of a node's endpoints: overrides, and what the middleware cannot connect.

    Args:
        node: Whose publishers and subscriptions they are.
    """

    def __init__(self, node: "Node") -> None:
        self._node = node
        self._found: dict[tuple[str, str], tuple[str, QoSProfile]] = {}
        self._used: set[str] = set()

    def options(self, topic: str, own: str, profile: Any) -> dict[str, Any]:
        """Further arguments of `create_publisher` and `create_subscription`, with a profile that a user may have overridden.

        Args:
            topic: Name of the topic as it is given.
            own: publisher or subscription.
            profile: Quality of service, or its depth.
        """
        profile = copy.copy(profile)  # rclpy writes the overrides into it
        callbacks = PublisherEventCallbacks if own == "publisher" else SubscriptionEventCallbacks
        made: dict[str, Any] = {"event_callbacks": callbacks(incompatible_qos=partial(self._note, topic, own, profile))}
        prefix = f"{OVERRIDES}{self._node.resolve_topic_name(topic)}.{own}."
        if given := {name for name in self._given() if name.startswith(prefix)}:
            self._used |= given
            made["qos_overriding_options"] = QoSOverridingOptions([QoSPolicyKind[name.upper()] for name in POLICIES])
        return {**made, "qos_profile": profile}

    def check(self) -> None:
        """Check the values of all overrides.

        Raises:
            ParameterError: a policy does not exist, or does not have the value.
        """
        for name in sorted(self._given()):
            policy = name.rpartition(".")[2]
            if policy not in POLICIES:
                raise ParameterError(f"{name} is not allowed: a policy is one of {', '.join(POLICIES)}")
            value, values = self._node._parameter_overrides[name].value, POLICIES[policy]
            if value not in values if values else type(value) is not int or value < 1:
                allowed = f"one of {', '.join(values)}" if values else "an integer of at least 1"
                raise ParameterError(f"{name} = {value} is not allowed: it takes {allowed}")

    def unused(self) -> str:
        """The overrides that belong to no publisher or subscription of the node; empty if all do."""
        return ", ".join(sorted(self._given() - self._used))

    def problem(self) -> str:
        """The endpoints that cannot be connected and are still there; empty if there are none."""
        for (name, own), (_, profile) in list(self._found.items()):
            if not self._others(name, own, profile):
                del self._found[name, own]
        return "; ".join(text for text, _ in self._found.values())

    def _given(self) -> set[str]:
        return {name for name in getattr(self._node, "_parameter_overrides", {}) if name.startswith(OVERRIDES)}

    def _note(self, topic: str, own: str, profile: QoSProfile, event: Any) -> None:
        name = self._node.resolve_topic_name(topic)
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        nodes = ", ".join(dict.fromkeys(self._others(name, own, profile))) or "another node"
        other = "subscription" if own == "publisher" else "publisher"
        text = (
            f"{name}: nothing passes between this {own} and the {other} of {nodes}, because their {policy} is not compatible:"
            f" change it there, or here by {OVERRIDES}{name}.{own}.{policy}"
        )
        self._found[name, own] = text, profile
        self._node.get_logger().warning(text)

    def _others(self, name: str, own: str, profile: QoSProfile) -> list[str]:
        """The nodes whose endpoints of a topic the graph shows as incompatible with a profile of this node."""
        if own == "subscription":
            infos = self._node.get_publishers_info_by_topic(name)
            return [info.node_name for info in infos if not qos.compatible(info.qos_profile, profile)]
        infos = self._node.get_subscriptions_info_by_topic(name)
        return [info.node_name for info in infos if not qos.compatible(profile, info.qos_profile)]
