"""A plant and its reference ship, as the controller sees them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from vessel_hsmc_msgs.msg import ControlState, ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos

Array = NDArray[np.float64]

STEP = 10_000_000
STATE = np.array([5.0, 1.0, 0.5, 0.3, 0.1, 0.02])
REFERENCE = np.array([5.5, 1.2, 0.45, 0.4, 0.0, 0.01])
ACCELERATION = np.array([0.1, 0.0, 0.01])


class Plant:
    """Publishes odometry and reference in place of plant and reference ship, and collects the output of the controller."""

    def __init__(self, bench: Any, lockstep: bool = True) -> None:
        self.bench = bench
        profile = qos.data(lockstep)
        self.odometry = bench.publisher(Odometry, "odom", lockstep)
        self.reference = bench.publisher(ReferenceState, "reference", lockstep)
        self.commands = bench.collect(WrenchStamped, "cmd_wrench", profile)
        self.states = bench.collect(ControlState, "controller/state", profile)

    def send_odometry(self, stamp: int, state: Array | Sequence[float] = STATE) -> None:
        message = conv.new_odometry()
        conv.write_odometry(message, conv.time_message(stamp), np.asarray(state))
        self.odometry.publish(message)

    def send_reference(
        self, stamp: int, state: Array | Sequence[float] = REFERENCE, acceleration: Array | Sequence[float] = ACCELERATION
    ) -> None:
        message = conv.new_reference()
        conv.write_reference(message, conv.time_message(stamp), np.asarray(state), np.asarray(acceleration))
        self.reference.publish(message)

    def connect(self, node: Any) -> Any:
        self.bench.until(lambda: node.connected and self.odometry.get_subscription_count())
        return node

    def stamps(self) -> list[int]:
        return [conv.nanoseconds(m.header.stamp) for m in self.commands]

    def wrenches(self) -> list[tuple[float, float]]:
        return [conv.read_wrench(m) for m in self.commands]


class RealTimePlant(Plant):
    """Publishes odometry and reference every STEP of simulated time.

    Attributes:
        state: The state of the odometry; None publishes none.
        desired: The state of the reference; None publishes none.
        reference_age, odometry_age: How much older than the time their stamps are, ns.
    """

    def __init__(self, bench: Any, time: Any) -> None:
        super().__init__(bench, lockstep=False)
        self.time = time
        self.state: Array | None = STATE
        self.desired: Array | None = REFERENCE
        self.reference_age = self.odometry_age = 0
        self.last: dict[str, int] = {}

    def start(self, node_class: Any, **parameters: Any) -> Any:
        """Start a controller in real-time mode on simulated time, and wait until it is connected."""
        node = self.bench.start(node_class, lockstep=False, use_sim_time=True, **parameters)
        self.bench.until(lambda: self.odometry.get_subscription_count() and self.reference.get_subscription_count())
        outputs = [p for p in node.publishers if p.topic_name in ("/cmd_wrench", "/controller/state")]
        self.bench.until(lambda: node.connected and all(output.get_subscription_count() for output in outputs))
        return node

    def run(self, seconds: float) -> None:
        self.time.run(seconds, self._send)

    def _send(self) -> None:
        if self.time.now % STEP:
            return
        if self.desired is not None:
            self.send_reference(self.time.now - self.reference_age, self.desired)
            self.last["reference"] = self.time.now
        if self.state is not None:
            self.send_odometry(self.time.now - self.odometry_age, self.state)
            self.last["odometry"] = self.time.now

    def first_zero_after(self, stamp: int) -> int:
        """Stamp of the first command after a time whose wrench is zero, ns."""
        return next(at for at, wrench in zip(self.stamps(), self.wrenches(), strict=True) if at > stamp and not any(wrench))


class Helm:
    """Receives the messages of the plant and publishes commands, in place of a controller."""

    def __init__(self, bench: Any, lockstep: bool = True) -> None:
        self.bench = bench
        profile = qos.data(lockstep)
        self.odometry = bench.collect(Odometry, "odom", profile)
        self.applied = bench.collect(WrenchStamped, "applied_wrench", profile)
        self.disturbance = bench.collect(WrenchStamped, "disturbance", profile)
        self.commands = bench.publisher(WrenchStamped, "cmd_wrench", lockstep)

    def command(self, stamp: int, force: float = 0.0, moment: float = 0.0, frame: str = conv.BODY) -> Any:
        message = conv.new_wrench()
        message.header.frame_id = frame
        conv.write_wrench(message, conv.time_message(stamp), (force, moment))
        self.commands.publish(message)

    def stamps(self) -> Any:
        return [conv.nanoseconds(m.header.stamp) for m in self.odometry]


def command(node: Any) -> Any:
    """What a node's diagnostics state about its commands."""
    return next(task for task in node.diagnostic_tasks() if task.name == "command")
