"""A ROS context, an executor and a probe for each test; the test's own thread spins until a condition holds."""

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

import pytest
import rclpy
from driving import Plant
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.executor import PromptExecutor

DEADLINE = 60.0

LOOK = 0.01
"""Time after which a condition is looked at again when nothing comes, s."""

T = TypeVar("T")


class Bench:
    """Nodes under test beside a probe that communicates with them over DDS."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.executor = PromptExecutor(self.context)
        self.probe = rclpy.create_node("probe", context=self.context)
        self.executor.add_node(self.probe)
        self.nodes: list[Any] = []

    def start(
        self,
        node_class: Any,
        lockstep: bool = True,
        namespace: str = "",
        remaps: Mapping[str, str] | None = None,
        **parameters: Any,
    ) -> Any:
        """Start a node under test, in lockstep by default; `__` in the name of a parameter stands for a dot."""
        own = {"start_enabled": True, "vessel.length": 32.0, "black_box.duration": 0.0}
        values = {"lockstep": lockstep, **(own if node_class.NAME == "controller" and not lockstep else {}), **parameters}
        overrides = [Parameter(n, value=v) for n, v in {n.replace("__", "."): v for n, v in values.items()}.items()]
        renamed = [part for own, other in (remaps or {}).items() for part in ("-r", f"{own}:={other}")]
        cli_args = ["--ros-args", *renamed] if renamed else None
        node = node_class(context=self.context, namespace=namespace, parameter_overrides=overrides, cli_args=cli_args)
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
        found: list[T] = []

        def waiting() -> bool:
            if not found and (result := condition()):
                found.append(result)
            return not found and time.monotonic() < end

        self.executor.spin_while(waiting, LOOK)
        assert found, f"the condition did not hold within {deadline:g} s"
        return found[0]

    def spin(self, seconds: float) -> None:
        """Spin for a time, s, to show that something does not happen."""
        end = time.monotonic() + seconds
        self.executor.spin_while(lambda: time.monotonic() < end, LOOK)

    def serve(self, rounds: int = 1, wait: float = 0.0) -> None:
        """Serve what is ready a number of times; waits for it each time, s."""
        left = rounds + 2  # the executor looks twice before its first round

        def again() -> bool:
            nonlocal left
            left -= 1
            return left > 0

        self.executor.spin_while(again, wait)

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
        self._bench.serve(3)

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
