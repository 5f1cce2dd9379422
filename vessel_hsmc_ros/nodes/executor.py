"""An executor with a fast path for the few subscriptions that determine a node's rate.

rclpy's SingleThreadedExecutor builds a new wait set of all entities of a node for every single callback, services, timers and
parameter events included, which costs more than the messages themselves. This one waits for the named subscriptions alone, takes
all messages they hold, and serves everything else a fixed number of times a second.
"""

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Any

from rclpy.context import Context
from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.subscription import Subscription

SERVICE_PERIOD = 0.02
"""Longest delay of timers, services and other subscriptions, s."""

BURST = 64
"""Messages taken from one subscription before the next is served."""


class DirectExecutor(SingleThreadedExecutor):
    """Serves `subscriptions` as soon as they hold a message, and all other entities of its nodes every SERVICE_PERIOD.

    Args:
        subscriptions: Those served directly. The list may grow while the executor runs.
        poll_period: Poll the subscriptions with this period, s, so that many messages cost one wake-up; 0 waits for messages
            instead.
        context: The context of the nodes.
        service_period: Time after which everything else is served again, s.
    """

    def __init__(
        self,
        subscriptions: list[Subscription],
        poll_period: float = 0.0,
        context: Context | None = None,
        service_period: float = SERVICE_PERIOD,
    ) -> None:
        super().__init__(context=context)
        self._service_period = service_period
        self._known: set[int] = set()
        self._direct = subscriptions
        self._poll_period = poll_period
        self._next_service = 0.0

    def spin_while(self, running: Callable[[], bool]) -> None:
        """Serve callbacks until `running` returns False; an exception of a callback is raised here."""
        with ExitStack() as held:
            # Within its context a handle cannot be destroyed, which the C structures of the wait set rely on.
            held.enter_context(self._context.handle)
            wait_set = None
            size = 0
            while running() and self._context.ok():
                if len(self._direct) != size:
                    for subscription in self._direct[size:]:
                        held.enter_context(subscription.handle)
                    size = len(self._direct)
                    self._known = {id(subscription) for subscription in self._direct}
                    wait_set = rclpy_implementation.WaitSet(size, 0, 0, 0, 0, 0, self._context.handle)
                if not self.take_direct():
                    self._wait(wait_set)
                if time.monotonic() >= self._next_service:
                    self._serve_rest()

    def take_direct(self) -> bool:
        """Serve the messages in the queues of the direct subscriptions; returns whether there were any."""
        found = False
        for subscription in tuple(self._direct):
            take, kind, raw = subscription.handle.take_message, subscription.msg_type, subscription.raw
            wants_info = subscription._callback_type is Subscription.CallbackType.WithMessageInfo
            callback = subscription.callback
            for _ in range(BURST):  # bounded, so that a flood on one topic does not delay the others
                taken = take(kind, raw)
                if taken is None:  # the queue is empty
                    break
                found = True
                if wants_info:
                    callback(*taken)
                else:
                    callback(taken[0])
        return found

    def _wait(self, wait_set: object) -> None:
        if self._poll_period or wait_set is None:
            time.sleep(self._poll_period or SERVICE_PERIOD)
            return
        wait_set.clear_entities()  # type: ignore[attr-defined]
        for subscription in self._direct:
            wait_set.add_subscription(subscription.handle)  # type: ignore[attr-defined]
        wait_set.wait(int(SERVICE_PERIOD * 1e9))  # type: ignore[attr-defined]

    def _serve_rest(self) -> None:
        """Serve every other entity that is ready, but not for longer than a service period."""
        end = time.monotonic() + self._service_period
        with suppress(TimeoutException, ShutdownException):
            while time.monotonic() < end:
                handler, *_ = self.wait_for_ready_callbacks(timeout_sec=0.0)
                handler()
                handler.result()  # raises the exception of the callback
        self._next_service = time.monotonic() + self._service_period

    def can_execute(self, entity: Any) -> bool:
        """Leave the direct subscriptions out of rclpy's wait set: with many of them, building it would take most of the time."""
        return id(entity) not in self._known and super().can_execute(entity)
