"""Two executors: one for real time, and one for lockstep with a fast path for the few subscriptions that determine the rate.

rclpy's SingleThreadedExecutor gathers all entities of a node anew for every wait, the event handlers of each publisher and
subscription included, and runs each callback as a coroutine: half a millisecond, several times what most callbacks take. These
two gather the entities when they have changed, take all messages that a subscription holds, and leave to rclpy what comes rarely.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any

from rclpy.client import Client
from rclpy.context import Context
from rclpy.event_handler import EventHandler
from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.guard_condition import GuardCondition
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from rclpy.waitable import NumberOfEntities

from vessel_hsmc_ros.nodes.rclpy_parts import InvalidHandle, WaitSet, own_guard, taker, wants_info

if TYPE_CHECKING:
    from rclpy.node import Node

BURST = 64  # messages taken from one subscription before the next is served, so that a flood on one does not delay the others
LONGEST_WAIT = 0.1  # time after which `running` is looked at again, s: a signal does not end the wait
BOUND = 0.002  # time after which timers and messages are served again while there are requests, s
EVENT_PERIOD = 0.5  # longest delay of quality-of-service events, such as a publisher that a subscription cannot receive from, s
SERVICE_PERIOD = 0.02  # longest delay in lockstep of timers, services and other subscriptions than the direct ones, s


class Queues:
    """The messages that some subscriptions hold. `burst`: messages of a subscription that are served before the next one."""

    def __init__(self, subscriptions: Sequence[Subscription], burst: int = BURST) -> None:
        self._parts = [(taker(each), each.callback, slice(None if wants_info(each) else 1)) for each in subscriptions]
        self._burst = range(burst)

    def serve(self) -> bool:
        """Serve each subscription in turn; returns whether there was any message."""
        found = False
        for take, callback, given in self._parts:
            for _ in self._burst:
                if (taken := take()) is None:
                    break
                found = True
                callback(*taken[given])
        return found


class Entities:
    """What some nodes have to be served, and a wait set of it.

    `guard`: the executor's own guard condition, which `wake` triggers. `held`: keeps all handles from being destroyed, which the
    C structures of a wait set rely on.

    Attributes:
        ready: The actions that were found ready by the last wait.
    """

    def __init__(self, nodes: Sequence["Node"], guard: Any, context: Any, held: ExitStack) -> None:
        self.timers = [timer for node in nodes for timer in node.timers]
        self.subscriptions = [subscription for node in nodes for subscription in node.subscriptions]
        guards = [guard, *(each for node in nodes for each in node.guards)]
        self._actions = [each for node in nodes for each in node.waitables if not isinstance(each, EventHandler)]
        self.ready: list[Any] = []
        self._handles = {
            "subscription": [each.handle for each in self.subscriptions],
            "guard_condition": [each.handle for each in guards],
            "timer": [each.handle for each in self.timers],
            "client": [each.handle for node in nodes for each in node.clients],
            "service": [each.handle for node in nodes for each in node.services],
        }
        for handle in (*self._actions, *(each for handles in self._handles.values() for each in handles)):
            held.enter_context(handle)
        counts = NumberOfEntities(*map(len, self._handles.values()))
        for action in self._actions:
            counts += action.get_num_entities()
        self._wait_set = WaitSet(*(getattr(counts, name) for name in counts.__slots__), context)

    def wait(self, longest: float) -> bool:
        """Wait for any of them; returns whether there is something besides messages, timers and actions."""
        self._wait_set.clear_entities()  # it forgets them with each wait
        for kind, handles in self._handles.items():
            add = getattr(self._wait_set, f"add_{kind}")
            for handle in handles:
                add(handle)
        for action in self._actions:
            action.add_to_wait_set(self._wait_set)
        self._wait_set.wait(int(longest * 1e9))
        self.ready = [action for action in self._actions if action.is_ready(self._wait_set)]
        return any(map(self._wait_set.get_ready_entities, ("guard_condition", "client", "service")))


class PromptExecutor(SingleThreadedExecutor):
    """Serves timers, messages, requests, responses and actions as they come, and quality-of-service events now and then."""

    def __init__(self, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._changed = True
        self._next_events = 0.0

    def wake(self) -> None:
        """Take note that a node has created or destroyed something."""
        self._changed = True
        super().wake()

    def can_execute(self, entity: Any) -> bool:
        """Leave timers, messages and actions, which are served here, out of rclpy's wait set; its events are many, and rare.

        An action notes its places in the wait set that it was added to last: it cannot be in two of them.
        """
        return isinstance(entity, Client | Service | GuardCondition | EventHandler) and super().can_execute(entity)

    def spin_while(self, running: Callable[[], bool], longest_wait: float = LONGEST_WAIT) -> None:
        """Serve callbacks until `running` returns False; an exception of a callback is raised here.

        `longest_wait`: time after which a wait in which nothing comes ends, s.
        """

        def unchanged() -> bool:
            return not self._changed and running()

        while running() and self._context.ok():
            self._changed = False
            with ExitStack() as held:
                held.enter_context(self._context.handle)
                entities = Entities(self.get_nodes(), own_guard(self), self._context.handle, held)
                self._spin(unchanged, entities, longest_wait)

    def _spin(self, unchanged: Callable[[], bool], entities: Entities, longest_wait: float) -> None:
        """Serve callbacks until one of them has created or destroyed something."""
        queues = Queues(entities.subscriptions)
        while unchanged() and self._context.ok():
            rest = entities.wait(longest_wait)
            self._call(entities.timers)
            if not self._changed:
                queues.serve()
            self._serve_rest(rest, entities.ready, BOUND)

    def _call(self, timers: list[Timer]) -> None:
        """Call the timers that are due; building rclpy's wait set for each would take longer than most of them do."""
        for timer in timers:
            due = False
            with suppress(InvalidHandle), timer.handle:  # the callback of another may have destroyed it
                due = timer.handle.is_timer_ready()
            if due:
                timer.handle.call_timer()
                timer.callback()

    def _serve_rest(self, rest: bool, actions: list[Any], bound: float) -> None:
        """Serve by rclpy what is neither a message nor a timer, if there is some or events are due, for a time of `bound`."""
        for action in actions:
            self.create_task(action.execute, action.take_data())
        now = time.monotonic()
        if not rest and not actions and now < self._next_events:
            return
        with suppress(TimeoutException, ShutdownException):
            while time.monotonic() < now + bound:
                handler, *_ = self.wait_for_ready_callbacks(timeout_sec=0.0)
                handler()
                handler.result()  # raises the exception of the callback
        self._next_events = time.monotonic() + EVENT_PERIOD


class DirectExecutor(PromptExecutor):
    """Serves some subscriptions as soon as they hold a message, and all else of its nodes when idle and every `service_period`.

    `subscriptions`: those served directly. The list may grow while the executor runs. `poll_period`: poll the subscriptions
    with this period, s, so that many messages cost one wake-up; 0 waits for messages instead.
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
        self._subscriptions = subscriptions
        self._poll_period = poll_period

    def _spin(self, unchanged: Callable[[], bool], entities: Entities, longest_wait: float) -> None:
        """Serve callbacks until one of them has created or destroyed something."""
        direct = tuple(self._subscriptions)
        known = set(map(id, direct))
        others = Queues([each for each in entities.subscriptions if id(each) not in known])
        # In the order of a step, one message of each at a time, none is asked in vain.
        steps = Queues(direct, BURST if self._poll_period else 1)
        wait_set = WaitSet(len(direct), 0, 0, 0, 0, 0, self._context.handle)
        next_service = 0.0
        while unchanged():
            busy = steps.serve() or self._wait(wait_set, direct)
            if busy and time.monotonic() < next_service:
                continue
            if not self._context.ok():  # asked rarely: it takes as long as a message
                return
            rest = entities.wait(0.0 if busy else longest_wait)
            self._call(entities.timers)
            end = time.monotonic() + self._service_period
            while not self._changed and others.serve() and time.monotonic() < end:
                pass
            self._serve_rest(rest, entities.ready, self._service_period)
            next_service = time.monotonic() + self._service_period

    def _wait(self, wait_set: Any, direct: Sequence[Subscription]) -> bool:
        """Wait for a message for a short time; returns whether there may be one."""
        if self._poll_period:
            time.sleep(self._poll_period)
            return True
        if not direct:
            return False
        wait_set.clear_entities()
        for subscription in direct:
            wait_set.add_subscription(subscription.handle)
        wait_set.wait(int(BOUND * 1e9))
        return bool(wait_set.get_ready_entities("subscription"))
