"""A ROS context, an executor and a probe for each test; the test's own thread spins until something is so."""

import time

import pytest
import rclpy
from driving import Plant
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from vessel_hsmc_ros.nodes import qos

DEADLINE = 10.0


class Bench:
    """Nodes under test beside a probe that talks to them over DDS."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[])
        self.executor = SingleThreadedExecutor(context=self.context)
        self.probe = rclpy.create_node("probe", context=self.context)
        self.executor.add_node(self.probe)
        self.nodes = []

    def start(self, node_class, **parameters):
        overrides = [Parameter(name.replace("__", "."), value=value) for name, value in parameters.items()]
        node = node_class(context=self.context, parameter_overrides=overrides)
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def publisher(self, kind, topic, lockstep=True):
        return self.probe.create_publisher(kind, topic, qos.data(lockstep))

    def collect(self, kind, topic, profile=None):
        """A list that fills with the messages of a topic."""
        messages = []
        self.probe.create_subscription(kind, topic, messages.append, profile or qos.LOSSLESS)
        return messages

    def until(self, condition, deadline=DEADLINE):
        """Spin until the condition holds; what it came to."""
        end = time.monotonic() + deadline
        while not (result := condition()):
            assert time.monotonic() < end, "it did not come to that in time"
            self.executor.spin_once(timeout_sec=0.05)
        return result

    def spin(self, seconds):
        """Spin for a while, to see that something does not happen."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def call(self, kind, name, request):
        client = self.probe.create_client(kind, name)
        self.until(client.service_is_ready)
        future = client.call_async(request)
        return self.until(lambda: future.done() and future.result())

    def close(self):
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.probe.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def bench():
    made = Bench()
    yield made
    made.close()


@pytest.fixture
def plant(bench):
    return Plant(bench)
