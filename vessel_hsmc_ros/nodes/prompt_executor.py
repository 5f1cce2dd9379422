"""An executor for real time: everything is served at once, at a fraction of the cost of rclpy's own.

rclpy's SingleThreadedExecutor gathers all entities of a node anew for every wait, the event handlers of each publisher and
subscription included, and runs each callback as a coroutine: half a millisecond, several times what the callback takes. This one
gathers them when they have changed.
"""

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from vessel_hsmc_ros.nodes.executor import DirectExecutor

if TYPE_CHECKING:
    from rclpy.node import Node

LONGEST_WAIT = 0.1
"""Time after which `running` is looked at again, s: a signal does not end the wait."""

BOUND = 0.002
"""Time after which timers and messages are served again while there are requests, s."""

EVENT_PERIOD = 0.5
"""Longest delay of quality-of-service events, such as a publisher that a subscription cannot receive from, s."""


class PromptExecutor(DirectExecutor):
    """Serves timers, messages, service requests and responses as they come, and quality-of-service events now and then.

    Args:
        context: The context of the nodes.
    """

    def __init__(self, context: Context | None = None) -> None:
        super().__init__([], context=context, service_period=BOUND)
        self._changed = True

    def wake(self) -> None:
        """Take note that a node has created or destroyed something."""
        self._changed = True
        super().wake()

    def can_execute(self, entity: Any) -> bool:
        """Leave timers and messages, which are served here, out of rclpy's wait set."""
        return not isinstance(entity, Timer | Subscription) and super().can_execute(entity)

    def spin_while(self, running: Callable[[], bool]) -> None:
        """Serve callbacks until `running` returns False; an exception of a callback is raised here."""
        while running() and self._context.ok():
            self._changed = False
            with ExitStack() as held:
                self._spin_unchanged(running, held)

    def _spin_unchanged(self, running: Callable[[], bool], held: ExitStack) -> None:
        """Serve callbacks until one of them has created or destroyed something."""
        held.enter_context(self._context.handle)
        timers, self._direct, others = _entities(self.get_nodes())
        guards = [self._guard.handle, *others["guards"]]
        handles = [timer.handle for timer in timers], others["clients"], others["services"]
        messages = [subscription.handle for subscription in self._direct]
        # Within its context a handle cannot be destroyed, which the C structures of the wait set rely on.
        for handle in (*messages, *guards, *(each for kind in handles for each in kind)):
            held.enter_context(handle)
        wait_set = rclpy_implementation.WaitSet(len(messages), len(guards), *map(len, handles), 0, self._context.handle)
        while not self._changed and running() and self._context.ok():
            _fill(wait_set, messages, guards, *handles)
            wait_set.wait(int(LONGEST_WAIT * 1e9))
            rest = any(map(wait_set.get_ready_entities, ("guard_condition", "client", "service")))
            self._call(timers)
            if not self._changed:
                self.take_direct()
            if rest or time.monotonic() >= self._next_service:
                self._serve_rest()
                self._next_service = time.monotonic() + EVENT_PERIOD

    def _call(self, timers: list[Timer]) -> None:
        """Call the timers that are due; the others of them later, if one has created or destroyed something."""
        for timer in timers:
            if not self._changed and timer.handle.is_timer_ready():
                timer.handle.call_timer()
                timer.callback()


def _entities(nodes: "list[Node]") -> tuple[list[Timer], list[Subscription], dict[str, list[Any]]]:
    """The timers and subscriptions of some nodes, and the handles of what else a wait set takes."""
    timers = [timer for node in nodes for timer in node.timers]
    subscriptions = [subscription for node in nodes for subscription in node.subscriptions]
    others = {kind: [each.handle for node in nodes for each in getattr(node, kind)] for kind in ("guards", "clients", "services")}
    return timers, subscriptions, others


def _fill(wait_set: Any, messages: Any, guards: Any, timers: Any, clients: Any, services: Any) -> None:
    """Add handles to a wait set, which forgets them with each wait."""
    wait_set.clear_entities()
    for add, handles in (
        (wait_set.add_subscription, messages),
        (wait_set.add_guard_condition, guards),
        (wait_set.add_timer, timers),
        (wait_set.add_client, clients),
        (wait_set.add_service, services),
    ):
        for handle in handles:
            add(handle)
