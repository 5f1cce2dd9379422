"""When the control law runs: the base of the timings, and what they use of the controller node."""

from abc import ABC, abstractmethod
from contextlib import AbstractContextManager

from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.loop.control_loop import ControlLoop
from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.nodes.control_diagnostics import ControlDiagnostics
from vessel_hsmc_ros.nodes.controller_inputs import ControllerInputs, Desired, Measured
from vessel_hsmc_ros.nodes.managed import ManagedNode


class TimedNode(ManagedNode):
    """A controller node as its timing sees it."""

    loop: ControlLoop  # the control loop
    inputs: ControllerInputs  # the latest odometry and reference that count
    health: ControlDiagnostics  # what the diagnostics report of law and timing
    stamp: int  # time of the last command, ns
    clock_problem: str  # what is wrong with a simulated clock; empty if nothing is

    @property
    @abstractmethod
    def computes(self) -> bool:
        """Whether the law is stepped, for its command or its terms."""

    @abstractmethod
    def timed(self) -> AbstractContextManager[None]:
        """Measure the computation time of the law."""

    @abstractmethod
    def publish_command(self, stamp: int) -> None:
        """Publish the present command, with the time of a step, ns."""

    @abstractmethod
    def publish_period(self, stamp: int, terms: Terms | None) -> None:
        """Publish the command and the state of a control period: its time, ns, and the terms of the law if it has run."""

    @abstractmethod
    def report_clock(self, reason: Reason, problem: str) -> None:
        """Report a step of the clock."""

    @abstractmethod
    def has_consumer(self) -> bool:
        """Whether a node takes the command."""

    @abstractmethod
    def second_publisher(self) -> bool:
        """Whether another node commands as well."""

    @abstractmethod
    def refusal_text(self, reason: Reason) -> str:
        """The text of a reason, with the topic that it is about."""


class Timing(ABC):
    """When the law runs, and on which inputs."""

    def __init__(self, node: TimedNode) -> None:
        self._node = node

    @abstractmethod
    def start(self) -> None:
        """Begin, once the node is connected."""

    @abstractmethod
    def take_odometry(self, measured: Measured) -> None:
        """Take an odometry message."""

    @abstractmethod
    def take_reference(self, desired: Desired) -> None:
        """Take a reference message."""

    @property
    def waiting(self) -> int:
        """Number of references that wait for odometry of their stamp."""
        return 0

    @property
    def pending(self) -> int | None:
        """Stamp of the first odometry since the last command that waits for the reference of its stamp, ns."""
        return None

    def overdue(self) -> tuple[str, Reason] | None:
        """The input that is overdue, and why; in lockstep inputs are awaited."""
        return None

    def ready(self) -> Reason:
        """What is missing before the law may command; NONE if nothing is."""
        return Reason.NONE

    def renewed(self) -> None:  # noqa: B027 - in lockstep the plant counts the steps
        """Begin the control periods of a new control loop."""

    def stopped(self) -> None:  # noqa: B027 - in lockstep there is nothing to do
        """Act on a stop; in lockstep, the command of the next step is zero."""
