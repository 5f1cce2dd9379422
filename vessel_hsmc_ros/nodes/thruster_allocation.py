"""The thrust-allocation node: turns the commanded wrench into demands for single thrusters."""

import math
import sys
from typing import Any

from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64

from vessel_hsmc_ros.control.allocation import Allocation
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN, VesselNode
from vessel_hsmc_ros.nodes.process import run_node
from vessel_hsmc_ros.nodes.recent_problem import RecentProblem
from vessel_hsmc_ros.scenario.parameters import AllocationParameters

CHECK_PERIOD = 0.05
"""Time between two checks for an overdue command, s."""


class ThrusterAllocationNode(VesselNode):
    """Allocates the commanded wrench to the thrusters, and publishes a thrust and, where it turns, an angle for each.

    Every command is answered at once. A wrench that is out of reach is answered by the nearest one, moment before force, and the
    diagnostics report it as saturated. In real time a command that is not finite is ignored, and all thrusts are zero when the
    latest command is older than `command_timeout`.
    """

    NAME = "thruster_allocation"
    PARAMETERS = AllocationParameters

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._layout = self.parameters.vessel.thrusters
        if not self._layout:
            raise ParameterError("thruster_allocation.vessel.thrusters.names = [''] is not allowed: name at least one thruster")
        self._allocation = Allocation(self._layout)
        self._pending: list[tuple[int, tuple[float, float]]] = []
        self._speeds: list[float] = []
        self._received_at: int | None = None
        self._commands = self._saturated = self._ignored = self._timeouts = 0
        self._is_saturated = False
        self._problem = RecentProblem()
        self._create_topics(self.parameters.lockstep)
        self.reporter.offer("reset", self._reset)
        if not self.parameters.lockstep:
            self.create_timer(CHECK_PERIOD, self._check_age)

    def _create_topics(self, lockstep: bool) -> None:
        profile = qos.data(lockstep)
        self._demands_out = [
            (self.advertise(Float64, topic, profile, partner="odom"), i, part) for topic, i, part in self._layout.topics()
        ]
        thrusters = self._layout.thrusters()
        # Not advertised: hardware may take these, but no node of the loop does, and the start must not wait for one.
        self._speeds_out = [
            (self.create_publisher(Float64, f"thrusters/{t.name}/shaft_speed", profile), i, t)
            for i, t in enumerate(thrusters)
            if t.thrust_coefficient_ahead and t.thrust_coefficient_astern
        ]
        self._wrench_out = self.advertise(WrenchStamped, "allocated_wrench", profile)
        self._wrench = self.framed(conversions.new_wrench())
        self._needs_speed = self._layout.needs_speed
        self.listen(WrenchStamped, "cmd_wrench", self._on_command, profile)
        if self._needs_speed:
            self.listen(Odometry, "odom", self._on_odometry, profile)

    def describe(self) -> str:
        """The thrusters."""
        return f"thrusters {', '.join(f'{t.name} ({kind})' for t, kind in self._named_kinds())}"

    def _named_kinds(self) -> list[tuple[Any, str]]:
        kinds = self._layout.kinds
        return [(t, kinds[i % len(kinds)]) for i, t in enumerate(self._layout.thrusters())]

    def on_connected(self) -> None:
        """Answer the commands that were received before the start."""
        self._answer()

    # -- commands -----------------------------------------------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        if not self.parameters.lockstep:
            self._speeds.clear()
        self._speeds.append(message.twist.twist.linear.x)
        self._answer()

    def _on_command(self, message: WrenchStamped) -> None:
        command = conversions.read_wrench(message)
        if not (math.isfinite(command[0]) and math.isfinite(command[1])):
            self._refuse(f"commanded wrench ({command[0]} N, {command[1]} N·m) is not allowed: both must be finite numbers")
            return
        self._received_at = self.now()
        self._pending.append((conversions.nanoseconds(message.header.stamp), command))
        self._answer()

    def _refuse(self, reason: str) -> None:
        """Reject a command: in lockstep the run cannot continue without it, in real time the next one replaces it."""
        if self.parameters.lockstep:
            raise ControlError(reason)
        self._ignored += 1
        self._problem.report(WARN, f"{reason}; ignored")
        self.get_logger().error(f"{reason}; ignored", throttle_duration_sec=1.0)

    def _answer(self) -> None:
        """Answer the pending commands; with rudders, in lockstep, once the odometry that they answer has come."""
        while self.connected and self._pending:
            stamp, command = self._pending[0]
            if self._needs_speed and self.parameters.lockstep and not self._speeds:
                return
            del self._pending[0]
            self._publish(stamp, command)

    def _publish(self, stamp: int, command: tuple[float, float]) -> None:
        speed = self._speeds[0] if self._speeds else 0.0
        if self.parameters.lockstep:  # each message is answered by one command; late odometry does not have its stamp
            del self._speeds[:1]
        given = self._allocation.answer(stamp, command, speed if math.isfinite(speed) else 0.0)
        self.stamp = stamp
        self._commands += 1
        self._saturated += given.saturated
        self._is_saturated = given.saturated
        for publisher, i, part in self._demands_out:
            self.send(publisher, Float64(data=(given.thrust, given.angle)[part][i]))
        conversions.write_body_wrench(self._wrench, conversions.time_message(stamp), given.wrench)
        self.send(self._wrench_out, self._wrench)
        for publisher, i, thruster in self._speeds_out:
            self.send(publisher, Float64(data=thruster.shaft_speed(given.thrust[i])))

    def _check_age(self) -> None:
        """Real time: set all thrusts to zero when the latest command is overdue; angles hold."""
        now, limit = self.now(), self.parameters.command_timeout
        if self._received_at is None or now - self._received_at <= limit * NANOSECONDS:
            return
        self._received_at = None
        self._timeouts += 1
        self._allocation.stop()
        for publisher, _, part in self._demands_out:
            if part == 0:
                self.send(publisher, Float64(data=0.0))
        self._problem.report(WARN, f"no command for {limit:g} s: the thrust is zero")
        self.get_logger().warning(f"no command for {limit:g} s: the thrust is zero")

    # -- services and diagnostics -------------------------------------------------------------------------------------

    def retune(self, parameters: AllocationParameters) -> None:
        """Take a changed time-out."""

    def _reset(self) -> str:
        self._allocation.reset()
        return "thrusts are zero and angles straight; time goes on"

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Numbers of answered, saturated and ignored commands."""
        values = {
            "commands": self._commands,
            "saturated": self._is_saturated,
            "saturated_commands": self._saturated,
            "ignored_commands": self._ignored,
            "timeouts": self._timeouts,
        }
        if self._problem.current:
            return *self._problem.current, values
        if self._received_at is None and self._timeouts and not self.parameters.lockstep:
            return WARN, "no recent command: the thrust is zero", values
        if not self._commands:
            return OK, f"waiting for a command on {self.resolve_topic_name('cmd_wrench')}", values
        return OK, "saturated: the nearest wrench is given" if self._is_saturated else "running", values


def main(arguments: list[str] | None = None) -> int:
    """Run the node until a signal ends it."""
    return run_node(ThrusterAllocationNode, arguments)


if __name__ == "__main__":
    sys.exit(main())
