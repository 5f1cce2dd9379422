"""A ROS context, an executor and a probe for each test; the test's own thread spins until a condition holds."""

import time
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import pytest
import rclpy
from driving import Plant
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos

DEADLINE = 60.0

T = TypeVar("T")


class Bench:
    """Nodes under test beside a probe that communicates with them over DDS."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.executor = SingleThreadedExecutor(context=self.context)
        self.probe = rclpy.create_node("probe", context=self.context)
        self.executor.add_node(self.probe)
        self.nodes: list[Any] = []

    def start(self, node_class: Any, lockstep: bool = True, namespace: str = "", **parameters: Any) -> Any:
        """Start a node under test, in lockstep by default; `__` in the name of a parameter stands for a dot."""
        box = {"black_box.duration": 0.0} if node_class.NAME == "controller" and not lockstep else {}
        values = {"lockstep": lockstep, **box, **parameters}
        overrides = [Parameter(n, value=v) for n, v in {n.replace("__", "."): v for n, v in values.items()}.items()]
        node = node_class(context=self.context, namespace=namespace, parameter_overrides=overrides)
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def stop(self, node: Any) -> None:
        """Remove and destroy a node."""
        self.nodes.remove(node)
        self.executor.remove_node(node)
        node.destroy_node()

    def publisher(self, kind: Any, topic: str, lockstep: bool = True) -> Publisher:
        return self.probe.create_publisher(kind, topic, qos.data(lockstep))

    def collect(self, kind: Any, topic: str, profile: QoSProfile | None = None) -> list[Any]:
        """Subscribe to a topic; returns a list to which its messages are appended."""
        messages: list[Any] = []
        self.probe.create_subscription(kind, topic, messages.append, profile or qos.LOSSLESS)
        return messages

    def until(self, condition: Callable[[], T], deadline: float = DEADLINE) -> T:
        """Spin until the condition holds; returns its value. The test fails after the deadline, s."""
        end = time.monotonic() + deadline
        while not (result := condition()):
            assert time.monotonic() < end, f"the condition did not hold within {deadline:g} s"
            self.executor.spin_once(timeout_sec=0.05)
        return result

    def spin(self, seconds: float) -> None:
        """Spin for a time, s, to show that something does not happen."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def call(self, kind: Any, name: str, request: Any) -> Any:
        client = self.probe.create_client(kind, name)
        self.until(client.service_is_ready)
        future = client.call_async(request)
        return self.until(lambda: future.done() and future.result())

    def set_parameters(self, node: str, **values: Any) -> Any:
        """Set parameters of a node atomically and return the result; `__` in a name stands for a dot."""
        client = AsyncParameterClient(self.probe, node)
        self.until(client.services_are_ready)
        changes = [Parameter(name.replace("__", "."), value=value) for name, value in values.items()]
        future = client.set_parameters_atomically(changes)
        return self.until(lambda: future.done() and future.result()).result

    def close(self) -> None:
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.probe.destroy_node()
        rclpy.shutdown(context=self.context)


class SimulatedTime:
    """Publishes /clock in ticks of 2.5 ms; every node has received a tick before the next one is published."""

    TICK = 2_500_000

    def __init__(self, bench: Bench) -> None:
        self.now = 0
        self._bench = bench
        self._clock = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)

    def jump(self, nanoseconds: int) -> None:
        """Advance the clock in one step, ns, and serve what becomes ready."""
        self._bench.until(lambda: self._clock.get_subscription_count() >= len(self._bench.nodes))
        self.now += nanoseconds
        self._clock.publish(Clock(clock=conversions.time_message(self.now)))
        self._bench.until(lambda: all(node.now() == self.now for node in self._bench.nodes))
        # Timers that this instant has made ready, and the messages that their callbacks publish.
        for _ in range(4):
            self._bench.executor.spin_once(timeout_sec=0.0)

    def run(self, seconds: float, every_tick: Callable[[], None] = lambda: None) -> None:
        """Advance the clock tick by tick, calling `every_tick` after each.

        Args:
            seconds: Simulated time to pass, s.
            every_tick: Called after each tick.
        """
        for _ in range(round(seconds * 1e9) // self.TICK):
            self.jump(self.TICK)
            every_tick()


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.fixture
def plant(bench: Bench) -> Plant:
    return Plant(bench)


@pytest.fixture
def simulated_time(bench: Bench) -> SimulatedTime:
    return SimulatedTime(bench)
