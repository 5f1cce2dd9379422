"""Two executors: one with a fast path for the few subscriptions that determine a node's rate, and one for real time.

rclpy's SingleThreadedExecutor builds a new wait set of all entities of a node for every single callback, services, timers and
parameter events included, which costs more than the messages themselves. The direct one waits for the named subscriptions alone,
takes all messages they hold, and serves everything else a fixed number of times a second.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any

from rclpy.context import Context
from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.subscription import Subscription
from rclpy.timer import Timer

if TYPE_CHECKING:
    from rclpy.node import Node


SERVICE_PERIOD = 0.02  # longest delay of timers, services and other subscriptions, s
BURST = 64  # messages taken from one subscription before the next is served


def take_all(subscriptions: Sequence[Subscription]) -> bool:
    """Serve the messages in the queues of subscriptions; returns whether there were any."""
    found = False
    for subscription in tuple(subscriptions):
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


class DirectExecutor(SingleThreadedExecutor):
    """Serves `subscriptions` as soon as they hold a message, and all other entities of its nodes every SERVICE_PERIOD.

    `subscriptions`: those served directly. The list may grow while the executor runs. `poll_period`: poll the subscriptions
    with this period, s, so that many messages cost one wake-up; 0 waits for messages instead. `service_period`: time after
    which everything else is served again, s. `polled`: further subscriptions, served with everything else.
    """

    def __init__(
        self,
        subscriptions: list[Subscription],
        poll_period: float = 0.0,
        context: Context | None = None,
        service_period: float = SERVICE_PERIOD,
        polled: list[Subscription] | None = None,
    ) -> None:
        super().__init__(context=context)
        self._service_period = service_period
        self._known: set[int] = set()
        self._direct, self._polled = subscriptions, [] if polled is None else polled
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
                    wait_set = rclpy_implementation.WaitSet(size, 0, 0, 0, 0, 0, self._context.handle)
                busy = take_all(self._direct) or self._wait(wait_set)
                if not busy or time.monotonic() >= self._next_service:
                    self._call([timer for node in self.get_nodes() for timer in node.timers])
                    self._serve_rest()

    def _call(self, timers: list[Timer]) -> None:
        """Call the timers that are due; building rclpy's wait set for each would take longer than most of them do."""
        for timer in timers:
            due = False
            with suppress(rclpy_implementation.InvalidHandle), timer.handle:  # the callback of another may have destroyed it
                due = timer.handle.is_timer_ready()
            if due:
                timer.handle.call_timer()
                timer.callback()

    def _wait(self, wait_set: Any) -> bool:
        """Wait for a message, at most for SERVICE_PERIOD; returns whether there may be one."""
        if self._poll_period or wait_set is None:
            time.sleep(self._poll_period or SERVICE_PERIOD)
            return wait_set is not None
        wait_set.clear_entities()
        for subscription in self._direct:
            wait_set.add_subscription(subscription.handle)
        wait_set.wait(int(SERVICE_PERIOD * 1e9))
        return bool(wait_set.get_ready_entities("subscription"))

    def _serve_rest(self) -> None:
        """Serve every other entity that is ready, but not for longer than a service period."""
        self._known = {id(subscription) for subscription in (*self._direct, *self._polled)}
        end = time.monotonic() + self._service_period
        while take_all(self._polled) and time.monotonic() < end:
            pass
        end = time.monotonic() + self._service_period
        with suppress(TimeoutException, ShutdownException):
            while time.monotonic() < end:
                handler, *_ = self.wait_for_ready_callbacks(timeout_sec=0.0)
                handler()
                handler.result()  # raises the exception of the callback
        self._next_service = time.monotonic() + self._service_period

    def can_execute(self, entity: Any) -> bool:
        """Leave timers and direct subscriptions out of rclpy's wait set: building it for each would take most of the time."""
        return not isinstance(entity, Timer) and id(entity) not in self._known and super().can_execute(entity)


LONGEST_WAIT = 0.1  # time after which `running` is looked at again, s: a signal does not end the wait
BOUND = 0.002  # time after which timers and messages are served again while there are requests, s
EVENT_PERIOD = 0.5  # longest delay of quality-of-service events, such as a publisher that a subscription cannot receive from, s
ACTION_PERIOD = 0.05  # longest delay of actions, s


class PromptExecutor(DirectExecutor):
    """Serves timers, messages, service requests and responses as they come, and quality-of-service events now and then.

    rclpy's SingleThreadedExecutor gathers all entities of a node anew for every wait, the event handlers of each publisher and
    subscription included, and runs each callback as a coroutine: half a millisecond, several times what the callback takes. This
    one gathers them when they have changed.
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

    def spin_while(self, running: Callable[[], bool], longest_wait: float = LONGEST_WAIT) -> None:
        """Serve callbacks until `running` returns False; an exception of a callback is raised here.

        `longest_wait`: time after which a wait in which nothing comes ends, s.
        """
        while running() and self._context.ok():
            self._changed = False
            with ExitStack() as held:
                self._spin_unchanged(running, int(longest_wait * 1e9), held)

    def _spin_unchanged(self, running: Callable[[], bool], longest_wait: int, held: ExitStack) -> None:
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
        # Not in this wait set: an action notes its places in the wait set that it was added to last, which has to be rclpy's own.
        waitables = [each.get_num_entities() for node in self.get_nodes() for each in node.waitables]
        period = ACTION_PERIOD if any(count.num_services or count.num_clients for count in waitables) else EVENT_PERIOD
        while not self._changed and running() and self._context.ok():
            _fill(wait_set, messages, guards, *handles)
            wait_set.wait(longest_wait)
            rest = any(map(wait_set.get_ready_entities, ("guard_condition", "client", "service")))
            self._call(timers)
            if not self._changed:
                take_all(self._direct)
            if rest or time.monotonic() >= self._next_service:
                self._serve_rest()
                self._next_service = time.monotonic() + period


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
