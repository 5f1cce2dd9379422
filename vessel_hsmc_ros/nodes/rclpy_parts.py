"""The parts of rclpy in use that its documentation does not have, in one place: what another version of rclpy may change."""

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.executors import Executor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

RCLError = rclpy_implementation.RCLError
"""What an operation raises that the middleware refuses."""

RMWError = rclpy_implementation.RMWError
"""What the middleware raises, such as for a message that is damaged."""

InvalidHandle = rclpy_implementation.InvalidHandle
"""What the use of a destroyed entity raises."""

WaitSet = rclpy_implementation.WaitSet
"""Waits for entities by their handles: the numbers of subscriptions, guard conditions, timers, clients, services and events."""


def taker(subscription: Subscription) -> Callable[[], tuple[Any, dict[str, int]] | None]:
    """What takes the next message of a subscription, with its information; None if there is none."""
    return partial(subscription.handle.take_message, subscription.msg_type, subscription.raw)


def wants_info(subscription: Subscription) -> bool:
    """Whether the callback of a subscription takes the information about a message besides the message."""
    return bool(subscription._callback_type is Subscription.CallbackType.WithMessageInfo)


def publish(publisher: Publisher, data: bytes) -> None:
    """Publish a serialised message, as `Publisher.publish` does after checks that take as long."""
    publisher.handle.publish_raw(data)


def own_guard(executor: Executor) -> Any:
    """The guard condition that `wake` triggers."""
    return executor._guard


def overrides(node: Node) -> dict[str, Parameter]:
    """The parameters that were given to a node, by their names; what is added counts as given."""
    found: dict[str, Parameter] = getattr(node, "_parameter_overrides", {})  # none yet while the node is being made
    return found
