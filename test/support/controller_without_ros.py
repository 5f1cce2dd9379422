"""The controller node without ROS: its own code for inputs, periods, clock and commands, with a stub in the place of rclpy."""

import math
from collections import Counter
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import deserialize_message

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, Terms
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.schema import build
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import controller_timing
from vessel_hsmc_ros.nodes.base import LAST_COMMANDS
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.controller_diagnostics import ControlDiagnostics
from vessel_hsmc_ros.nodes.controller_inputs import ControllerInputs
from vessel_hsmc_ros.nodes.controller_timing import RealTime
from vessel_hsmc_ros.nodes.reporting import RecentProblem
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.parameters import ControllerParameters

Pair = tuple[float, float]


class DrawnLaw(Law[Any]):
    """A law whose wrench is drawn by a test, and which notes what it is called with.

    Attributes:
        wrench: What it commands next; None where it is undefined.
        motion, desired: What it was last called with; None if it was not.
        fresh: Whether it was reset since the last call.
    """

    def __init__(self, keeps_limits: bool) -> None:
        self.keeps_limits = keeps_limits  # type: ignore[misc]
        self.vessel = KnownVessel()
        self.wrench: Pair | None = (0.0, 0.0)
        self.motion: Motion | None = None
        self.desired: Motion | None = None
        self.fresh = True

    def retune(self, parameters: Any) -> None:
        """There is nothing to tune."""

    def reset(self) -> None:
        """Note it."""
        self.fresh = True

    def step(self, motion: Motion, desired: Motion, acceleration: Acceleration) -> tuple[Pair, Terms]:
        """The drawn wrench."""
        del acceleration
        self.motion, self.desired = motion, desired
        if self.wrench is None:
            raise ControlError("the drawn law is undefined here")
        return self.wrench, Terms()


class Ignoring:
    """Stands for a logger, a timer, a publisher and the ROS graph: every method does nothing."""

    def __getattr__(self, name: str) -> Any:
        return lambda *_, **__: 1


class SteadyClock:
    """Stands for the module `time` where the controller watches its clock."""

    def __init__(self) -> None:
        self.now = 10**12

    def monotonic_ns(self) -> int:
        """The steady time, ns."""
        return self.now


class ControllerWithoutRos(ControllerNode):
    """A controller in real time, of which everything but rclpy is real.

    Args:
        simulated: Whether its clock is simulated time.
        keeps_limits: Whether the drawn law keeps to the limits of the vessel.
        settings: Further parameters.

    Attributes:
        sent: The commands that were published since `take_sent`: stamp and wrench.
        ros_time, steady: The node's clock, ns, and the steady one.
    """

    def __init__(self, simulated: bool, keeps_limits: bool, settings: dict[str, Any]) -> None:
        self.ros_time, self.steady = 0, SteadyClock()
        self.sent: list[tuple[int, Pair]] = []
        self.simulated = simulated
        values = {"lockstep": False, "start_enabled": False, "law": "guided", **settings}
        self.parameters = build(ControllerParameters, values, "controller")
        self.drawn = DrawnLaw(keeps_limits)
        self.loop = make_control_loop(self.parameters, self.drawn)
        self.loop.supervision.standby()
        self.clock_problem, self.connected, self.black_box, self.wall = "", True, None, None
        self._logger = Ignoring()
        self.compatibility: Any = SimpleNamespace(problem=lambda: "")
        self.inputs = ControllerInputs(self, self.loop)
        self._steps = self.timer = RealTime(self)
        self._clock_step = RecentProblem()
        self._unfit = ""
        self._begun, self._zeros, self.stamp = True, LAST_COMMANDS, -1
        self._updates, self._compute_time, self._compute_time_max = 0, 0.0, 0.0
        self._alarms: dict[Any, Any] = {}
        self._violations: Counter[Any] = Counter()
        self._known = self.loop.law.known
        self.health = ControlDiagnostics(self.loop, False)
        self._command = conv.Outgoing(conv.new_wrench(), conv.WRENCH)
        self._state = conv.Outgoing(conv.new_control_state(), conv.CONTROL_STATE)
        self._command_out, self._state_out = Ignoring(), self
        self._commanding: Any = Ignoring()
        self._guiding: Any = Ignoring()
        self._measuring = []

    def take_sent(self) -> list[tuple[int, Pair]]:
        """The commands that were published since the last call."""
        sent, self.sent = self.sent, []
        return sent

    @contextmanager
    def on_its_clock(self) -> Any:
        """In this context the controller sees the steady clock of the test."""
        with patch.object(controller_timing, "time", self.steady):
            yield

    # -- what rclpy and its node would do ----------------------------------------------------------------------------

    lifecycle = "active"

    def get_logger(self) -> Any:
        return self._logger

    def now(self) -> int:
        return self.ros_time

    def send(self, publisher: Any, message: Any) -> None:
        if publisher is self._command_out:
            message = deserialize_message(message, WrenchStamped)
            wrench = conv.read_wrench(message)
            assert all(map(math.isfinite, wrench))
            self.sent.append((conv.nanoseconds(message.header.stamp), wrench))

    def get_parameter(self, name: str) -> Any:
        assert name == "use_sim_time"
        return type("Value", (), {"value": self.simulated})

    def create_timer(self, *_: Any, **__: Any) -> Any:
        return Ignoring()

    def destroy_timer(self, *_: Any) -> bool:
        return True

    def count_publishers(self, *_: Any) -> int:
        return 1

    def resolve_topic_name(self, topic: str, **_: Any) -> str:
        return f"/{topic}"

    def has_consumer(self) -> bool:
        return True
