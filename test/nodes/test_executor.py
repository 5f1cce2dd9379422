import time
from types import SimpleNamespace
from typing import Any

import pytest
from std_msgs.msg import Int64
from std_srvs.srv import Trigger

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.executor import BURST, DirectExecutor, Queues


@pytest.mark.parametrize("poll_period", [0.0, 0.01])
def test_direct_subscriptions_timers_and_services_are_all_served(bench: Any, poll_period: Any) -> None:
    received, ticks, calls = [], [], []
    publisher = bench.probe.create_publisher(Int64, "numbers", qos.LOSSLESS)
    bench.executor.remove_node(bench.probe)
    subscription = bench.probe.create_subscription(Int64, "numbers", lambda m: received.append(m.data), qos.LOSSLESS)
    bench.probe.create_timer(0.05, lambda: ticks.append(len(received)))

    def on_call(_request: Any, response: Any) -> Any:
        calls.append(1)
        return response

    bench.probe.create_service(Trigger, "call", on_call)
    client = bench.probe.create_client(Trigger, "call")
    direct = DirectExecutor([subscription], poll_period, bench.context)
    direct.add_node(bench.probe)
    end = time.monotonic() + 10.0
    sent = 0

    def running() -> Any:
        nonlocal sent
        served = calls and len(ticks) > 3
        if len(received) == sent and not served:  # the messages pause only once timer and service have been served
            publisher.publish(Int64(data=sent))
            sent += 1
            if sent == 100:
                client.call_async(Trigger.Request())
        return time.monotonic() < end and not (served and len(received) == sent)

    direct.spin_while(running)
    direct.shutdown()
    assert received == list(range(sent))
    assert calls
    assert len(ticks) > 3, "the timer was not served while messages kept coming"


def test_exceptions_of_callbacks_are_raised_by_the_executor(bench: Any) -> None:
    def fail(_message: Any) -> Any:
        raise RuntimeError("as it must")

    bench.executor.remove_node(bench.probe)
    publisher = bench.probe.create_publisher(Int64, "numbers", qos.LOSSLESS)
    subscription = bench.probe.create_subscription(Int64, "numbers", fail, qos.LOSSLESS)
    direct = DirectExecutor([subscription], 0.0, bench.context)
    direct.add_node(bench.probe)
    end = time.monotonic() + 10.0
    publisher.publish(Int64())
    with pytest.raises(RuntimeError, match="as it must"):
        direct.spin_while(lambda: time.monotonic() < end)
    direct.shutdown()


def test_subscriptions_added_while_it_spins_are_served(bench: Any) -> None:
    received: list[Any] = []
    subscriptions: list[Any] = []
    bench.executor.remove_node(bench.probe)
    publisher = bench.probe.create_publisher(Int64, "numbers", qos.LOSSLESS)

    def subscribe() -> Any:
        if not subscriptions:
            subscriptions.append(bench.probe.create_subscription(Int64, "numbers", received.append, qos.LOSSLESS))
            publisher.publish(Int64())

    bench.probe.create_timer(0.1, subscribe)
    direct = DirectExecutor(subscriptions, 0.0, bench.context)
    direct.add_node(bench.probe)
    end = time.monotonic() + 10.0
    direct.spin_while(lambda: time.monotonic() < end and not received)
    direct.shutdown()
    assert received


def test_a_flood_on_one_topic_delays_the_others_by_a_burst_and_loses_nothing() -> None:
    order: list[str] = []

    def topic(name: str, count: int) -> Any:
        left = [count]

        def take(*_: Any) -> Any:
            left[0] -= 1
            return (name, {}) if left[0] >= 0 else None

        return SimpleNamespace(
            handle=SimpleNamespace(take_message=take), msg_type=None, raw=False, _callback_type=None, callback=order.append
        )

    topics = Queues([topic("flood", 3 * BURST + 5), topic("stop", 1), topic("quiet", 0)])
    assert [topics.serve() for _ in range(5)] == [True] * 4 + [False]
    assert order.index("stop") == BURST
    assert order.count("flood") == 3 * BURST + 5


def test_other_subscriptions_are_served_with_the_timers_and_lose_nothing(bench: Any) -> None:
    hot: list[int] = []
    polled: list[int] = []
    bench.executor.remove_node(bench.probe)
    publishers = [bench.probe.create_publisher(Int64, topic, qos.LOSSLESS) for topic in ("hot", "recorded")]
    direct_ones, _ = (
        [bench.probe.create_subscription(Int64, topic, lambda m, to=to: to.append(m.data), qos.LOSSLESS)]
        for topic, to in (("hot", hot), ("recorded", polled))
    )
    direct = DirectExecutor(direct_ones, context=bench.context)
    direct.add_node(bench.probe)
    count, end = 3 * BURST, time.monotonic() + 10.0

    numbers = iter(range(count))

    def running() -> bool:
        if (number := next(numbers, None)) is not None:
            for publisher in publishers:
                publisher.publish(Int64(data=number))
        return len(polled) < count and time.monotonic() < end

    direct.spin_while(running)
    direct.shutdown()
    assert hot == polled == list(range(count))


def test_a_timer_that_the_callback_of_another_destroys_is_not_called(bench: Any) -> None:
    called: list[str] = []
    timers: dict[str, Any] = {}
    bench.executor.remove_node(bench.probe)

    def call(name: str, other: str) -> None:
        called.append(name)
        bench.probe.destroy_timer(timers[other])

    for name, other in (("first", "second"), ("second", "first")):
        timers[name] = bench.probe.create_timer(0.01, lambda name=name, other=other: call(name, other))
    direct = DirectExecutor([], 0.05, bench.context)
    direct.add_node(bench.probe)
    end = time.monotonic() + 10.0
    direct.spin_while(lambda: len(called) < 3 and time.monotonic() < end)
    direct.shutdown()
    assert len(called) == 3
    assert len(set(called)) == 1
