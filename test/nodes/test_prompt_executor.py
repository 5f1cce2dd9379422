import time
from collections.abc import Callable
from typing import Any

import pytest
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64
from std_srvs.srv import Trigger

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.executor import PromptExecutor

Serve = Callable[[Callable[[], Any]], None]


@pytest.fixture
def serve(bench: Any) -> Serve:
    """Spin the probe until a condition holds, or for ten seconds."""

    def spin(done: Callable[[], Any]) -> None:
        bench.executor.remove_node(bench.probe)
        end = time.monotonic() + 10.0
        with PromptExecutor(bench.context) as executor:
            executor.add_node(bench.probe)
            executor.spin_while(lambda: time.monotonic() < end and not done())

    return spin


def test_messages_timers_services_and_responses_are_all_served(bench: Any, serve: Serve) -> None:
    received: list[int] = []
    futures: list[Any] = []
    calls: list[int] = []
    publisher = bench.probe.create_publisher(Int64, "numbers", qos.LOSSLESS)
    bench.probe.create_subscription(Int64, "numbers", lambda m: received.append(m.data), qos.LOSSLESS)

    def on_call(_request: Any, response: Any) -> Any:
        calls.append(len(received))
        return response

    bench.probe.create_service(Trigger, "call", on_call)
    client = bench.probe.create_client(Trigger, "call")

    def tick() -> None:
        publisher.publish(Int64(data=len(received)))
        if len(received) == 5:
            futures.append(client.call_async(Trigger.Request()))

    bench.probe.create_timer(0.01, tick)
    serve(lambda: futures and all(future.done() for future in futures) and len(received) > 20)
    assert calls
    assert all(future.done() for future in futures)
    assert sorted(set(received)) == list(range(max(received) + 1))


def test_what_a_callback_creates_is_served_and_what_it_destroys_is_not(bench: Any, serve: Serve) -> None:
    ticks = {"first": 0, "second": 0}

    def second() -> None:
        ticks["second"] += 1

    def first() -> None:
        ticks["first"] += 1
        bench.probe.destroy_timer(timer)
        bench.probe.create_timer(0.02, second)

    timer = bench.probe.create_timer(0.02, first)
    serve(lambda: ticks["second"] >= 3)
    assert ticks == {"first": 1, "second": 3}


def test_an_exception_of_a_callback_is_raised_by_the_prompt_executor(bench: Any, serve: Serve) -> None:
    def fail() -> None:
        raise RuntimeError("as it must")

    bench.probe.create_timer(0.01, fail)
    with pytest.raises(RuntimeError, match="as it must"):
        serve(lambda: False)


def test_a_publisher_of_an_incompatible_quality_is_reported(bench: Any, serve: Serve) -> None:
    events: list[Any] = []
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    callbacks = SubscriptionEventCallbacks(incompatible_qos=events.append)
    bench.probe.create_subscription(Int64, "numbers", lambda _: None, qos.STREAM, event_callbacks=callbacks)
    bench.probe.create_publisher(Int64, "numbers", best_effort)
    serve(lambda: events)
    assert events
